// Checks access: users, groups, keys.

#include "base/network/keys.h"
#include "client/files/keys.h"
#include "client/doctor/checks.h"

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace traction::doctor {

namespace {

using List = std::vector<Finding>;

/// Returns the numbers behind a word of /proc/self/status.
std::vector<std::string> ofOurselves(const Box& box, const std::string& word) {
  for (const std::string& line : linesOf(box.read("/proc/self/status").text)) {
    auto words = wordsOf(line);
    if (words.empty() || words[0] != word + ":") continue;
    words.erase(words.begin());
    return words;
  }
  return {};
}

void checkGroup(const Patient& patient, List& findings) {
  const auto group = idOf(patient.box, "/etc/group", "tractiond");
  if (!idOf(patient.box, "/etc/passwd", "tractiond") || !group) {
    findings.push_back(
        {"user and group", Verdict::kFail, "there is no user or no group tractiond", "sudo systemd-sysusers"});
    return;
  }
  const auto users = ofOurselves(patient.box, "Uid");
  if (users.size() < 2) {
    findings.push_back({"user and group", Verdict::kUnknown, "not known: /proc/self/status cannot be read"});
    return;
  }
  auto groups = ofOurselves(patient.box, "Groups");
  const auto own = ofOurselves(patient.box, "Gid");
  groups.insert(groups.end(), own.begin(), own.end());
  const bool isIn = std::find(groups.begin(), groups.end(), std::to_string(*group)) != groups.end();
  if (users[1] == "0" || isIn) {
    findings.push_back(
        {"user and group", Verdict::kOk, users[1] == "0" ? "you are root" : "you are in the group tractiond"});
  } else {
    findings.push_back({"user and group", Verdict::kWarn,
                        "you are not in the group tractiond, for which the sockets are",
                        "sudo usermod -aG tractiond $USER    # then log in again"});
  }
}

/// Returns the command that sets owner and mode of a file.
std::string ownCommand(const std::string& owner, const std::string& mode, const std::string& file) {
  std::string command = "sudo chown ";
  command.append(owner).append(1, ' ').append(file).append(" && sudo chmod ").append(mode).append(1, ' ').append(file);
  return command;
}

void checkKeys(const Patient& patient, List& findings) {
  const std::string folder = tractiond::network::kKeyDirectory;
  const Box::FileStatus status = patient.box.fileStatus(folder);
  constexpr unsigned kOthersWrite = 022, kOthers = 007, kGroupReads = 040;
  if (status.error == ENOENT) {
    findings.push_back({"keys", Verdict::kOk, "there are none: clients of other hosts cannot connect"});
    return;
  }
  if (status.error != 0) {
    findings.push_back({"keys", Verdict::kUnknown, "not known: " + folder + ": " + std::strerror(status.error)});
    return;
  }
  if (status.user != 0 || (status.mode & kOthersWrite) != 0) {
    findings.push_back({"keys", Verdict::kFail,
                        "others than root can write in " + folder + ", and thereby allow clients",
                        ownCommand("root", "755", folder)});
    return;
  }
  const Box::Listing files = patient.box.list(folder);
  if (files.error != 0) {
    findings.push_back(
        {"keys", Verdict::kUnknown, "not known: " + folder + " cannot be listed: " + std::strerror(files.error)});
    return;
  }
  const auto gateway = idOf(patient.box, "/etc/group", "traction-gateway");
  int keys = 0;
  std::string unknown;
  for (const std::string& name : files.names) {
    const std::string file = folder + "/" + name;
    const Box::FileStatus one = patient.box.fileStatus(file);
    if (one.error != 0) {
      unknown = file + ": " + std::strerror(one.error);
      continue;
    }
    const bool isSecret = name == "gateway.secret";
    if (isSecret && ((one.mode & (kOthers | kOthersWrite)) != 0 || one.user != 0)) {
      findings.push_back({"keys", Verdict::kFail, "others can read or change the box's secret key " + file,
                          ownCommand("root:traction-gateway", "640", file)});
      return;
    }
    if (isSecret && (!gateway || one.group != *gateway || (one.mode & kGroupReads) == 0)) {
      findings.push_back({"keys", Verdict::kFail, "the gateway may not read " + file,
                          ownCommand("root:traction-gateway", "640", file)});
      return;
    }
    if (!isSecret && (one.user != 0 || (one.mode & kOthersWrite) != 0)) {
      findings.push_back(
          {"keys", Verdict::kFail, "others than root can change " + file, ownCommand("root", "644", file)});
      return;
    }
    keys += isSecret ? 0 : 1;
  }
  if (unknown.empty())
    findings.push_back({"keys", Verdict::kOk, std::to_string(keys) + " clients may connect"});
  else
    findings.push_back({"keys", Verdict::kUnknown, "not known: " + unknown});
}

void checkOwnKey(const Patient& patient, List& findings) {
  const std::string file = client::usualKeyFile();
  const Box::FileStatus status = patient.box.fileStatus(file);
  if (status.error == ENOENT) {
    findings.push_back({"your key", Verdict::kOk, "there is none"});
  } else if (status.error != 0) {
    findings.push_back({"your key", Verdict::kUnknown, "not known: " + file + ": " + std::strerror(status.error)});
  } else if ((status.mode & 077U) != 0) {
    findings.push_back({"your key", Verdict::kFail, "others can read " + file, "chmod 600 " + file});
  } else {
    findings.push_back({"your key", Verdict::kOk, "no other user can read it"});
  }
}

}  // namespace

void checkAccess(const Patient& patient, List& findings) {
  checkGroup(patient, findings);
  checkKeys(patient, findings);
  checkOwnKey(patient, findings);
}

}  // namespace traction::doctor

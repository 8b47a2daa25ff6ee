// Checks access: users, groups, keys.

#include "base/network/keys.h"
#include "client/doctor/checks.h"
#include "client/files/keys.h"

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace traction::doctor {

namespace {

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

Finding checkGroup(const Patient& patient) {
  const auto group = idOf(patient.box, "/etc/group", "tractiond");
  if (!idOf(patient.box, "/etc/passwd", "tractiond") || !group)
    return fail("there is no user or no group tractiond", "sudo systemd-sysusers");
  const auto users = ofOurselves(patient.box, "Uid");
  if (users.size() < 2) return unknown("/proc/self/status cannot be read");
  auto groups = ofOurselves(patient.box, "Groups");
  const auto own = ofOurselves(patient.box, "Gid");
  groups.insert(groups.end(), own.begin(), own.end());
  const bool isIn = std::find(groups.begin(), groups.end(), std::to_string(*group)) != groups.end();
  if (users[1] == "0" || isIn) return ok(users[1] == "0" ? "you are root" : "you are in the group tractiond");
  return warn("you are not in the group tractiond, for which the sockets are",
              "sudo usermod -aG tractiond $USER    # then log in again");
}

/// Returns the command that sets owner and mode of a file.
std::string ownCommand(const std::string& owner, const std::string& mode, const std::string& file) {
  std::string command = "sudo chown ";
  command.append(owner).append(1, ' ').append(file).append(" && sudo chmod ").append(mode).append(1, ' ').append(file);
  return command;
}

Finding checkKeys(const Patient& patient) {
  const std::string folder = tractiond::network::kKeyDirectory;
  const Box::FileStatus status = patient.box.fileStatus(folder);
  constexpr unsigned kOthersWrite = 022, kOthers = 007, kGroupReads = 040;
  if (status.error == ENOENT) return ok("there are none: clients of other hosts cannot connect");
  if (status.error != 0) return unknown(folder + ": " + std::strerror(status.error));
  if (status.user != 0 || (status.mode & kOthersWrite) != 0)
    return fail("others than root can write in " + folder + ", and thereby allow clients",
                ownCommand("root", "755", folder));
  const Box::Listing files = patient.box.list(folder);
  if (files.error != 0) return unknown(folder + " cannot be listed: " + std::strerror(files.error));
  const auto gateway = idOf(patient.box, "/etc/group", "traction-gateway");
  int keys = 0;
  std::string unread;
  for (const std::string& name : files.names) {
    const std::string file = folder + "/" + name;
    const Box::FileStatus one = patient.box.fileStatus(file);
    if (one.error != 0) {
      unread = file + ": " + std::strerror(one.error);
      continue;
    }
    const bool isSecret = name == "gateway.secret";
    if (isSecret && ((one.mode & (kOthers | kOthersWrite)) != 0 || one.user != 0))
      return fail("others can read or change the box's secret key " + file,
                  ownCommand("root:traction-gateway", "640", file));
    if (isSecret && (!gateway || one.group != *gateway || (one.mode & kGroupReads) == 0))
      return fail("the gateway may not read " + file, ownCommand("root:traction-gateway", "640", file));
    if (!isSecret && (one.user != 0 || (one.mode & kOthersWrite) != 0))
      return fail("others than root can change " + file, ownCommand("root", "644", file));
    keys += isSecret ? 0 : 1;
  }
  if (unread.empty()) return ok(std::to_string(keys) + " clients may connect");
  return unknown(unread);
}

Finding checkOwnKey(const Patient& patient) {
  const std::string file = client::usualKeyFile();
  const Box::FileStatus status = patient.box.fileStatus(file);
  if (status.error == ENOENT) return ok("there is none");
  if (status.error != 0) return unknown(file + ": " + std::strerror(status.error));
  if ((status.mode & 077U) != 0) return fail("others can read " + file, "chmod 600 " + file);
  return ok("no other user can read it");
}

}  // namespace

void checkAccess(const Patient& patient, std::vector<Finding>& findings) {
  add(findings, "user and group", checkGroup(patient));
  add(findings, "keys", checkKeys(patient));
  add(findings, "your key", checkOwnKey(patient));
}

}  // namespace traction::doctor

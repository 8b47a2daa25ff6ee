// Checks access: users, groups, keys.

#include "base/network/keys.h"
#include "client/doctor/checks.h"

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

Finding checkKeys(const Patient& patient) {
  const std::string folder = tractiond::network::kKeyDirectory;
  const Box::FileStatus status = patient.box.fileStatus(folder);
  constexpr unsigned kOthersWrite = 022;
  if (status.error == ENOENT) return ok("there are none: clients of other hosts cannot connect");
  if (status.error != 0) return unknown(folder + ": " + std::strerror(status.error));
  if (status.user != 0 || (status.mode & kOthersWrite) != 0)
    return fail("others than root can write in " + folder + ", and thereby allow clients",
                "sudo chown root " + folder + " && sudo chmod 755 " + folder);
  const Box::Listing files = patient.box.list(folder);
  if (files.error != 0) return unknown(folder + " cannot be listed: " + std::strerror(files.error));
  int keys = 0;
  std::string unread;
  for (const std::string& name : files.names) {
    const std::string file = folder + "/" + name;
    const Box::FileStatus one = patient.box.fileStatus(file);
    if (one.error != 0) {
      unread = file + ": " + std::strerror(one.error);
      continue;
    }
    if (one.user != 0 || (one.mode & kOthersWrite) != 0)
      return fail("others than root can change " + file, "sudo chown root " + file + " && sudo chmod go-w " + file);
    keys += name == "gateway.secret" ? 0 : 1;
  }
  if (unread.empty()) return ok(std::to_string(keys) + " clients may connect");
  return unknown(unread);
}

}  // namespace

void checkAccess(const Patient& patient, std::vector<Finding>& findings) {
  add(findings, "user and group", checkGroup(patient));
  add(findings, "keys", checkKeys(patient));
}

}  // namespace traction::doctor

// Checks the machine itself: processors, time of day, USB, user and group.

#include "client/doctor/checks.h"

#include <algorithm>

namespace traction::doctor {

namespace {

Finding checkGovernor(const Patient& patient) {
  const std::string folder = "/sys/devices/system/cpu";
  int processors = 0, slow = 0;
  std::string other;
  for (const std::string& name : patient.box.list(folder)) {
    if (name.rfind("cpu", 0) != 0 || name.find_first_of("0123456789") != 3) continue;
    std::string file = folder;
    const auto governor = patient.box.line(file.append("/").append(name).append("/cpufreq/scaling_governor"));
    if (!governor) continue;
    ++processors;
    if (*governor == "performance") continue;
    ++slow;
    other = *governor;
  }
  if (processors == 0) return ok("the frequency of the processors is not scaled here");
  if (slow == 0) return ok("performance");
  return warn(std::to_string(slow) + " of " + std::to_string(processors) + " processors have \"" + other +
                  "\": a frame may wait until they are fast",
              "echo performance | sudo tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor");
}

Finding checkTime(const Patient& patient) {
  const auto keeps = patient.box.keepsTime();
  if (!keeps) return unknown("the kernel does not say whether it is kept");
  if (*keeps) return ok("kept by the network's");
  return warn("nobody keeps it: the times of messages drift from other hosts'",
              "sudo apt-get install systemd-timesyncd && sudo timedatectl set-ntp true");
}

Finding checkUsbRule(const Patient& patient) {
  if (!mayUseUsb(patient)) return ok("no camera is on USB");
  const auto folders = {"/etc", "/lib", "/usr/lib", "/usr/local/lib"};
  const bool hasRule = std::any_of(folders.begin(), folders.end(), [&](const std::string& folder) {
    return patient.box.exists(folder + "/udev/rules.d/60-tractiond.rules");
  });
  if (hasRule) return ok("the rule for cameras on USB is installed");
  return fail("the rule for cameras on USB is not installed",
              "sudo cp systemd/udev.rules /etc/udev/rules.d/60-tractiond.rules && sudo udevadm control --reload && "
              "sudo udevadm trigger --subsystem-match=usb");
}

/// Returns the numbers behind a word of /proc/self/status.
std::vector<std::string> ofOurselves(const Box& box, const std::string& word) {
  for (const std::string& line : box.lines("/proc/self/status")) {
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

}  // namespace

void checkMachine(const Patient& patient, std::vector<Finding>& findings) {
  add(findings, "governor", checkGovernor(patient));
  add(findings, "time of day", checkTime(patient));
  add(findings, "USB permissions", checkUsbRule(patient));
  add(findings, "user and group", checkGroup(patient));
}

}  // namespace traction::doctor

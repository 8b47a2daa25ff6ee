// Checks the machine itself: processors, time of day, USB.

#include "client/doctor/checks.h"

#include <algorithm>
#include <cstring>

namespace traction::doctor {

namespace {

Finding checkGovernor(const Patient& patient) {
  const std::string folder = "/sys/devices/system/cpu";
  int processors = 0, slow = 0;
  std::string other;
  for (const std::string& name : patient.box.list(folder).names) {
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

/// Returns the devices with an interface of USB3 Vision, which has class EF and subclass 05.
std::vector<std::string> usbCameras(const Box& box) {
  const std::string folder = "/sys/bus/usb/devices/";
  std::vector<std::string> devices;
  for (const std::string& name : box.list(folder).names) {
    const bool isVision =
        box.line(folder + name + "/bInterfaceClass") == "ef" && box.line(folder + name + "/bInterfaceSubClass") == "05";
    const std::string device = name.substr(0, name.find(':'));  // of the interface 2-1:1.0
    if (isVision && std::find(devices.begin(), devices.end(), device) == devices.end()) devices.push_back(device);
  }
  return devices;
}

Finding checkUsbPermissions(const Patient& patient) {
  if (!mayUseUsb(patient)) return ok("no camera is on USB");
  const auto folders = {"/etc", "/lib", "/usr/lib", "/usr/local/lib"};
  const bool hasRule = std::any_of(folders.begin(), folders.end(), [&](const std::string& folder) {
    return patient.box.exists(folder + "/udev/rules.d/60-tractiond.rules");
  });
  const std::string renew = "sudo udevadm control --reload && sudo udevadm trigger --subsystem-match=usb";
  if (!hasRule)
    return fail("the rule for cameras on USB is not installed",
                "sudo cp systemd/udev.rules /etc/udev/rules.d/60-tractiond.rules && " + renew);
  const auto group = idOf(patient.box, "/etc/group", "tractiond");
  std::string closed, unread;
  int cameras = 0;
  for (const std::string& device : usbCameras(patient.box)) {
    const std::string folder = "/sys/bus/usb/devices/" + device + "/";
    const auto three = [&](const char* file) {
      const std::string number = patient.box.line(folder + file).value_or("0");
      return std::string(number.size() < 3 ? 3 - number.size() : 0, '0') + number;
    };
    const std::string node = "/dev/bus/usb/" + three("busnum") + "/" + three("devnum");
    const Box::FileStatus status = patient.box.fileStatus(node);
    ++cameras;
    if (status.error != 0) unread = node + ": " + std::strerror(status.error);
    if (status.error != 0 || (status.mode & 006U) == 006U) continue;
    if (!group || status.group != *group || (status.mode & 060U) != 060U) closed += (closed.empty() ? "" : ", ") + node;
  }
  if (!closed.empty()) return fail(closed + " may not be opened by the group tractiond", renew);
  if (!unread.empty()) return unknown(unread);
  return ok(cameras == 0 ? "the rule is installed; there is no camera on USB"
                         : std::to_string(cameras) + " cameras may be opened");
}

}  // namespace

void checkMachine(const Patient& patient, std::vector<Finding>& findings) {
  add(findings, "governor", checkGovernor(patient));
  add(findings, "time of day", checkTime(patient));
  add(findings, "USB permissions", checkUsbPermissions(patient));
}

}  // namespace traction::doctor

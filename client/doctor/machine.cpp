// Checks the machine itself: clocks, processors, USB.

#include "client/doctor/checks.h"

#include <algorithm>
#include <array>
#include <cstring>

namespace traction::doctor {

namespace {

using List = std::vector<Finding>;

void checkGovernor(const Patient& patient, List& findings) {
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
  if (processors == 0) {
    findings.push_back({"governor", Verdict::kOk, "the frequency of the processors is not scaled here"});
  } else if (slow == 0) {
    findings.push_back({"governor", Verdict::kOk, "performance"});
  } else {
    findings.push_back({"governor", Verdict::kWarn,
                        std::to_string(slow) + " of " + std::to_string(processors) + " processors have \"" + other +
                            "\": a frame may wait until they are fast",
                        "echo performance | sudo tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor"});
  }
}

void checkClockSource(const Patient& patient, List& findings) {
  const std::string folder = "/sys/devices/system/clocksource/clocksource0/";
  const auto current = patient.box.line(folder + "current_clocksource");
  if (!current) {
    findings.push_back({"clock source", Verdict::kUnknown, "not known: " + folder + " cannot be read"});
    return;
  }
  // Clock sources that are read without a system call.
  constexpr std::array kFast = {"tsc", "kvm-clock", "hyperv_clocksource_tsc_page", "arch_sys_counter"};
  if (std::find(kFast.begin(), kFast.end(), *current) != kFast.end()) {
    findings.push_back({"clock source", Verdict::kOk, *current});
    return;
  }
  const auto words = wordsOf(patient.box.line(folder + "available_clocksource").value_or(""));
  const bool hasTsc = std::find(words.begin(), words.end(), "tsc") != words.end();
  findings.push_back({"clock source", Verdict::kWarn, *current + ": slow to read",
                      hasTsc ? "echo tsc | sudo tee " + folder + "current_clocksource"
                             : "tsc=reliable on the kernel's command line (GRUB_CMDLINE_LINUX in /etc/default/grub, "
                               "sudo update-grub), if the processors' counters agree"});
}

void checkTime(const Patient& patient, List& findings) {
  const auto keeps = patient.box.keepsTime();
  if (!keeps) {
    findings.push_back({"time of day", Verdict::kUnknown, "not known: the kernel does not say whether it is kept"});
  } else if (*keeps) {
    findings.push_back({"time of day", Verdict::kOk, "kept by the network's"});
  } else {
    findings.push_back({"time of day", Verdict::kWarn, "nobody keeps it: the times of messages drift from other hosts'",
                        "sudo apt-get install systemd-timesyncd && sudo timedatectl set-ntp true"});
  }
}

void checkUsbMemory(const Patient& patient, List& findings) {
  constexpr double kEnough_MB = 1000.0;
  const std::string file = "/sys/module/usbcore/parameters/usbfs_memory_mb";
  const auto size = patient.box.number(file);
  if (!mayUseUsb(patient)) {
    findings.push_back({"USB memory", Verdict::kOk, "no camera is on USB"});
  } else if (!size) {
    findings.push_back({"USB memory", Verdict::kUnknown, "not known: " + file + " cannot be read"});
  } else if (*size == 0.0 || *size >= kEnough_MB) {
    findings.push_back(
        {"USB memory", Verdict::kOk, *size == 0.0 ? "without a limit" : patient.box.line(file).value_or("") + " MB"});
  } else {
    findings.push_back(
        {"USB memory", Verdict::kWarn, patient.box.line(file).value_or("") + " MB: less than the buffers of a camera",
         "echo 1000 | sudo tee " + file + "    # at each start: sudo systemd-tmpfiles --create tractiond.conf"});
  }
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

void checkUsbPermissions(const Patient& patient, List& findings) {
  if (!mayUseUsb(patient)) {
    findings.push_back({"USB permissions", Verdict::kOk, "no camera is on USB"});
    return;
  }
  const auto folders = {"/etc", "/lib", "/usr/lib", "/usr/local/lib"};
  const bool hasRule = std::any_of(folders.begin(), folders.end(), [&](const std::string& folder) {
    return patient.box.exists(folder + "/udev/rules.d/60-tractiond.rules");
  });
  const std::string renew = "sudo udevadm control --reload && sudo udevadm trigger --subsystem-match=usb";
  if (!hasRule) {
    findings.push_back({"USB permissions", Verdict::kFail, "the rule for cameras on USB is not installed",
                        "sudo cp systemd/udev.rules /etc/udev/rules.d/60-tractiond.rules && " + renew});
    return;
  }
  const auto group = idOf(patient.box, "/etc/group", "tractiond");
  std::string closed, unknown;
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
    if (status.error != 0) unknown = node + ": " + std::strerror(status.error);
    if (status.error != 0 || (status.mode & 006U) == 006U) continue;
    if (!group || status.group != *group || (status.mode & 060U) != 060U) closed += (closed.empty() ? "" : ", ") + node;
  }
  if (!closed.empty()) {
    findings.push_back(
        {"USB permissions", Verdict::kFail, closed + " may not be opened by the group tractiond", renew});
  } else if (!unknown.empty()) {
    findings.push_back({"USB permissions", Verdict::kUnknown, "not known: " + unknown});
  } else {
    findings.push_back({"USB permissions", Verdict::kOk,
                        cameras == 0 ? "the rule is installed; there is no camera on USB"
                                     : std::to_string(cameras) + " cameras may be opened"});
  }
}

}  // namespace

void checkMachine(const Patient& patient, List& findings) {
  checkGovernor(patient, findings);
  checkClockSource(patient, findings);
  checkTime(patient, findings);
  checkUsbMemory(patient, findings);
  checkUsbPermissions(patient, findings);
}

}  // namespace traction::doctor

// Checks for other programs that use the same camera, ports or USB devices.

#include "client/doctor/checks.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <map>
#include <set>

namespace traction::doctor {

namespace {

using List = std::vector<Finding>;

/// Beginnings of their names: the kernel reports the first 15 letters.
constexpr std::array kCameraPrograms = {"arv-viewer", "arv-camera-test", "arv-tool",     "PylonViewer",  "pylonviewer",
                                        "SpinView",   "VimbaViewer",     "VimbaXViewer", "tcam-capture", "MVS"};

void checkCameraPrograms(const Patient& patient, List& findings) {
  std::string found, kill;
  for (const Process& process : patient.processes) {
    const bool isOne = std::any_of(kCameraPrograms.begin(), kCameraPrograms.end(),
                                   [&](const char* name) { return process.name.rfind(name, 0) == 0; });
    if (!isOne) continue;
    found += (found.empty() ? "" : ", ") + process.name + " (" + std::to_string(process.id) + ")";
    kill += " " + std::to_string(process.id);
  }
  if (found.empty() && !patient.whyUnknown.empty()) {
    findings.push_back({"camera programs", Verdict::kUnknown, "not known: " + patient.whyUnknown});
  } else if (found.empty()) {
    findings.push_back({"camera programs", Verdict::kOk, "none runs that is known to hold cameras"});
  } else {
    findings.push_back({"camera programs", Verdict::kWarn, found + " may hold the camera", "kill" + kill});
  }
}

void checkModemManager(const Patient& patient, List& findings) {
  const bool runs = std::any_of(patient.processes.begin(), patient.processes.end(),
                                [](const Process& one) { return one.name == "ModemManager"; });
  if (runs && mayUseUsb(patient)) {
    findings.push_back({"ModemManager", Verdict::kWarn,
                        "runs, and talks to new USB devices to see whether they are modems",
                        "sudo systemctl disable --now ModemManager"});
  } else if (!patient.whyUnknown.empty() && mayUseUsb(patient)) {
    findings.push_back({"ModemManager", Verdict::kUnknown, "not known: " + patient.whyUnknown});
  } else {
    findings.push_back({"ModemManager", Verdict::kOk, runs ? "runs; no camera is on USB" : "does not run"});
  }
}

/// Returns the first instance whose settings are not known, or null.
const Instance* unreadOf(const Patient& patient) {
  const auto found = std::find_if(patient.instances.begin(), patient.instances.end(),
                                  [](const Instance& one) { return !one.settings; });
  return found == patient.instances.end() ? nullptr : &*found;
}

/// Checks whether two instances use the same camera: by its id, or the first one that is found.
void checkSharedCamera(const Patient& patient, List& findings) {
  std::map<std::string, std::vector<const Instance*>> takers;
  for (const Instance& one : patient.instances) {
    if (one.settings) takers[one.settings->cameraId].push_back(&one);
  }
  for (const auto& [id, all] : takers) {
    if (all.size() < 2 || (id.empty() && patient.instances.size() < 2)) continue;
    std::string names;
    for (const Instance* one : all) names += (names.empty() ? "" : " and ") + one->name;
    findings.push_back({"a camera each", Verdict::kFail,
                        names + " take the same camera: " + (id.empty() ? "the first that is found" : id),
                        "camera.id = \"ANOTHER\" in " + all.back()->file + "    # tractiond --cameras lists them"});
    return;
  }
  if (const Instance* unread = unreadOf(patient); unread != nullptr && patient.instances.size() > 1) {
    findings.push_back(
        {"a camera each", Verdict::kUnknown, "not known: that of " + unread->name + ": " + unread->whyUnknown});
    return;
  }
  findings.push_back({"a camera each", Verdict::kOk, std::to_string(patient.instances.size()) + " instances"});
}

void checkTwoDaemons(const Patient& patient, List& findings) {
  for (const Instance& one : patient.instances) {
    if (one.processes.size() < 2) continue;
    std::string found, others;
    for (const int id : one.processes) found += (found.empty() ? "" : ", ") + std::to_string(id);
    for (std::size_t i = 1; i < one.processes.size(); ++i) others += " " + std::to_string(one.processes[i]);
    findings.push_back({"other daemons", Verdict::kFail,
                        "several tractiond of the instance " + one.name + " run: " + found, "sudo kill" + others});
    return;
  }
  if (patient.whyUnknown.empty())
    findings.push_back({"other daemons", Verdict::kOk, "no instance runs twice"});
  else
    findings.push_back({"other daemons", Verdict::kUnknown, "not known: " + patient.whyUnknown});
}

/// Returns the inodes of listening sockets, by port. `unread` is set to the table that cannot be read, with the reason,
/// if there is one.
std::map<int, std::set<std::string>> listeners(const Box& box, std::string& unread) {
  std::map<int, std::set<std::string>> all;
  for (const std::string table : {"/proc/net/tcp", "/proc/net/tcp6"}) {
    const Box::Reading reading = box.read(table);
    const bool lacksVersion6 = table.back() == '6' && reading.error == ENOENT;
    if (!reading && !lacksVersion6) unread = table + ": " + std::strerror(reading.error);
    for (const std::string& line : linesOf(reading.text)) {
      const auto words = wordsOf(line);  // number local remote state queues timer retransmits user timeout inode
      constexpr const char* kListens = "0A";
      if (words.size() < 10 || words[3] != kListens) continue;
      const std::string port = words[1].substr(words[1].rfind(':') + 1);
      all[static_cast<int>(std::strtol(port.c_str(), nullptr, 16))].insert(words[9]);
    }
  }
  return all;
}

/// Returns the process that has the socket, if its descriptors may be seen.
const Process* ownerOf(const Patient& patient, const std::string& inode) {
  const std::string socket = "socket:[" + inode + "]";
  for (const Process& process : patient.processes) {
    std::string folder = "/proc/";
    folder.append(std::to_string(process.id)).append("/fd/");
    for (const std::string& descriptor : patient.box.list(folder).names) {
      if (patient.box.target(folder + descriptor) == socket) return &process;
    }
  }
  return nullptr;
}

void checkPorts(const Patient& patient, List& findings) {
  std::string unknown;
  const auto all = listeners(patient.box, unknown);
  int asked = 0;
  for (const Instance& one : patient.instances) {
    for (const std::string& endpoint : one.settings ? one.settings->endpoints : std::vector<std::string>()) {
      if (endpoint.rfind("tcp://", 0) != 0) continue;
      const auto port = static_cast<int>(std::strtol(&endpoint[endpoint.rfind(':') + 1], nullptr, 10));
      ++asked;
      const auto taken = all.find(port);
      if (taken == all.end()) continue;
      for (const std::string& inode : taken->second) {
        const Process* owner = ownerOf(patient, inode);
        if (owner != nullptr ? owner->name == "tractiond" : !one.processes.empty()) continue;
        const std::string number = std::to_string(port);
        if (owner == nullptr && !patient.whyUnknown.empty()) {
          unknown = "which program has port " + number + " of " + one.name + ": " + patient.whyUnknown;
          continue;
        }
        findings.push_back(
            {"ports", Verdict::kFail,
             "port " + number + " of " + one.name + " is in use by " +
                 (owner != nullptr ? owner->name + " (" + std::to_string(owner->id) + ")" : "another program"),
             owner != nullptr
                 ? "sudo kill " + std::to_string(owner->id) + ", or other [publish] endpoints in " + one.file
                 : "sudo ss -ltnp 'sport = :" + number + "' tells which: stop it"});
        return;
      }
    }
  }
  if (const Instance* unread = unreadOf(patient)) unknown = "those of " + unread->name + ": " + unread->whyUnknown;
  if (!unknown.empty()) {
    findings.push_back({"ports", Verdict::kUnknown, "not known: " + unknown});
    return;
  }
  findings.push_back({"ports", Verdict::kOk, std::to_string(asked) + " asked for; nobody else has them"});
}

}  // namespace

void checkCompetitors(const Patient& patient, List& findings) {
  checkCameraPrograms(patient, findings);
  checkModemManager(patient, findings);
  checkSharedCamera(patient, findings);
  checkTwoDaemons(patient, findings);
  checkPorts(patient, findings);
}

}  // namespace traction::doctor

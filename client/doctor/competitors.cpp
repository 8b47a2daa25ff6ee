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

/// Beginnings of their names: the kernel reports the first 15 letters.
constexpr std::array kCameraPrograms = {"arv-viewer", "arv-camera-test", "arv-tool",     "PylonViewer",  "pylonviewer",
                                        "SpinView",   "VimbaViewer",     "VimbaXViewer", "tcam-capture", "MVS"};

Finding checkCameraPrograms(const Patient& patient) {
  std::string found, kill;
  for (const Process& process : patient.processes) {
    const bool isOne = std::any_of(kCameraPrograms.begin(), kCameraPrograms.end(),
                                   [&](const char* name) { return process.name.rfind(name, 0) == 0; });
    if (!isOne) continue;
    found += (found.empty() ? "" : ", ") + process.name + " (" + std::to_string(process.id) + ")";
    kill += " " + std::to_string(process.id);
  }
  if (found.empty() && !patient.whyUnknown.empty()) return unknown(patient.whyUnknown);
  if (found.empty()) return ok("none runs that is known to hold cameras");
  return warn(found + " may hold the camera", "kill" + kill);
}

Finding checkModemManager(const Patient& patient) {
  const bool runs = std::any_of(patient.processes.begin(), patient.processes.end(),
                                [](const Process& one) { return one.name == "ModemManager"; });
  if (runs && mayUseUsb(patient))
    return warn("runs, and talks to new USB devices to see whether they are modems",
                "sudo systemctl disable --now ModemManager");
  if (!patient.whyUnknown.empty() && mayUseUsb(patient)) return unknown(patient.whyUnknown);
  return ok(runs ? "runs; no camera is on USB" : "does not run");
}

/// Returns the first instance whose settings are not known, or null.
const Instance* unreadOf(const Patient& patient) {
  const auto found = std::find_if(patient.instances.begin(), patient.instances.end(),
                                  [](const Instance& one) { return !one.settings; });
  return found == patient.instances.end() ? nullptr : &*found;
}

/// Checks whether two instances use the same camera: by its id, or the first one that is found.
Finding checkSharedCamera(const Patient& patient) {
  std::map<std::string, std::vector<const Instance*>> takers;
  for (const Instance& one : patient.instances) {
    if (one.settings) takers[one.settings->cameraId].push_back(&one);
  }
  for (const auto& [id, all] : takers) {
    if (all.size() < 2 || (id.empty() && patient.instances.size() < 2)) continue;
    std::string names;
    for (const Instance* one : all) names += (names.empty() ? "" : " and ") + one->name;
    return fail(names + " take the same camera: " + (id.empty() ? "the first that is found" : id),
                "camera.id = \"ANOTHER\" in " + all.back()->file + "    # tractiond --cameras lists them");
  }
  if (const Instance* unread = unreadOf(patient); unread != nullptr && patient.instances.size() > 1)
    return unknown("that of " + unread->name + ": " + unread->whyUnknown);
  return ok(std::to_string(patient.instances.size()) + " instances");
}

Finding checkTwoDaemons(const Patient& patient) {
  for (const Instance& one : patient.instances) {
    if (one.processes.size() < 2) continue;
    std::string found, others;
    for (const int id : one.processes) found += (found.empty() ? "" : ", ") + std::to_string(id);
    for (std::size_t i = 1; i < one.processes.size(); ++i) others += " " + std::to_string(one.processes[i]);
    return fail("several tractiond of the instance " + one.name + " run: " + found, "sudo kill" + others);
  }
  if (patient.whyUnknown.empty()) return ok("no instance runs twice");
  return unknown(patient.whyUnknown);
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

Finding checkPorts(const Patient& patient) {
  std::string why;
  const auto all = listeners(patient.box, why);
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
          why = "which program has port " + number + " of " + one.name + ": " + patient.whyUnknown;
          continue;
        }
        return fail("port " + number + " of " + one.name + " is in use by " +
                        (owner != nullptr ? owner->name + " (" + std::to_string(owner->id) + ")" : "another program"),
                    owner != nullptr
                        ? "sudo kill " + std::to_string(owner->id) + ", or other [publish] endpoints in " + one.file
                        : "sudo ss -ltnp 'sport = :" + number + "' tells which: stop it");
      }
    }
  }
  if (const Instance* unread = unreadOf(patient)) why = "those of " + unread->name + ": " + unread->whyUnknown;
  if (!why.empty()) return unknown(why);
  return ok(std::to_string(asked) + " asked for; nobody else has them");
}

}  // namespace

void checkCompetitors(const Patient& patient, std::vector<Finding>& findings) {
  add(findings, "camera programs", checkCameraPrograms(patient));
  add(findings, "ModemManager", checkModemManager(patient));
  add(findings, "a camera each", checkSharedCamera(patient));
  add(findings, "other daemons", checkTwoDaemons(patient));
  add(findings, "ports", checkPorts(patient));
}

}  // namespace traction::doctor

// Checks the service of an instance: configuration, systemd unit, state directory, limits.

#include "client/doctor/checks.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <map>
#include <set>
#include <sstream>

namespace traction::doctor {

namespace {

using List = std::vector<Finding>;

void checkConfiguration(const Patient& patient, const Instance& instance, List& findings) {
  const std::string& file = instance.file;
  const Box::FileStatus status = patient.box.fileStatus(file);
  const Box::Reading reading = patient.box.read(file);
  if (reading.error == ENOENT) {
    findings.push_back({"configuration", Verdict::kOk, "there is none: the defaults hold"});
    return;
  }
  const auto user = idOf(patient.box, "/etc/passwd", "tractiond"), group = idOf(patient.box, "/etc/group", "tractiond");
  const bool readable = (status.mode & 004U) != 0 || (group && status.group == *group && (status.mode & 040U) != 0) ||
                        (user && status.user == *user && (status.mode & 0400U) != 0);
  if (status.error == 0 && !readable) {
    findings.push_back(
        {"configuration", Verdict::kFail, "the user tractiond may not read " + file, "sudo chmod 644 " + file});
    return;
  }
  if (!reading) {
    findings.push_back(
        {"configuration", Verdict::kUnknown, "not known: " + file + ": " + std::strerror(reading.error)});
    return;
  }
  const auto ran = patient.box.run({patient.program, "--instance", instance.name, "--config", file, "--check-config"});
  if (!ran) {
    findings.push_back({"configuration", Verdict::kUnknown, "not known: " + patient.program + " cannot be run"});
  } else if (ran->exitCode == 0) {
    findings.push_back({"configuration", Verdict::kOk, file + " is right"});
  } else {
    std::string why = ran->complaint.substr(0, ran->complaint.find('\n'));
    const std::string prefix = "tractiond: ";
    if (why.rfind(prefix, 0) == 0) why.erase(0, prefix.size());
    findings.push_back(
        {"configuration", Verdict::kFail, why, "sudoedit " + file + " && tractiond --check-config --config " + file});
  }
}

/// Returns the pairs KEY=VALUE of `systemctl show`.
std::map<std::string, std::string> shown(const Patient& patient, const std::string& unit) {
  const auto ran = patient.box.run(
      {"systemctl", "show", unit, "--property=LoadState,UnitFileState,ActiveState,Result,NRestarts,RestrictRealtime"});
  std::map<std::string, std::string> values;
  if (!ran || ran->exitCode != 0) return values;
  for (const std::string& line : linesOf(ran->output)) {
    if (const auto equals = line.find('='); equals != std::string::npos)
      values[line.substr(0, equals)] = line.substr(equals + 1);
  }
  return values;
}

void checkUnit(const Patient& patient, const Instance& instance, List& findings) {
  const std::string unit = "tractiond@" + instance.name;
  auto values = shown(patient, unit + ".service");
  if (values.empty()) {
    findings.push_back({"service", Verdict::kUnknown, "not known: systemctl does not answer"});
  } else if (values["LoadState"] != "loaded") {
    findings.push_back(
        {"service", Verdict::kFail, "systemd does not know " + unit,
         "sudo cmake --install build/programs && sudo systemctl daemon-reload, or sudo apt-get install tractiond"});
  } else if (values["ActiveState"] == "failed") {
    findings.push_back({"service", Verdict::kFail, unit + " has failed: " + values["Result"],
                        "journalctl -u " + unit + " -p warning -n 20 tells why; then sudo systemctl restart " + unit});
  } else if (values["UnitFileState"] != "enabled") {
    findings.push_back(
        {"service", Verdict::kWarn, unit + " does not start with the machine", "sudo systemctl enable --now " + unit});
  } else if (values["ActiveState"] != "active" && values["ActiveState"] != "reloading") {
    findings.push_back(
        {"service", Verdict::kWarn, unit + " is " + values["ActiveState"], "sudo systemctl start " + unit});
  } else {
    findings.push_back(
        {"service", Verdict::kOk, unit + " runs; started again " + values["NRestarts"] + " times by itself"});
  }
}

void checkState(const Patient& patient, const Instance& instance, List& findings) {
  constexpr std::uint64_t kEnough_bytes = 192 << 20;  // a gel's factors have 90 MB, and are written beside others
  const std::string folder = "/var/lib/tractiond/" + instance.name;
  const Box::FileStatus status = patient.box.fileStatus(folder);
  if (status.error != 0 && status.error != ENOENT) {
    findings.push_back(
        {"state directory", Verdict::kUnknown, "not known: " + folder + ": " + std::strerror(status.error)});
    return;
  }
  const auto space = patient.box.space(status.error == 0 ? folder : "/var/lib");
  const auto user = idOf(patient.box, "/etc/passwd", "tractiond");
  if (status.error == 0 && (!user || status.user != *user || (status.mode & 0300U) != 0300U)) {
    findings.push_back({"state directory", Verdict::kFail, "the user tractiond may not write in " + folder,
                        "sudo chown -R tractiond:tractiond " + folder + " && sudo chmod u+rwx " + folder});
  } else if (space && space->readOnly) {
    findings.push_back({"state directory", Verdict::kFail, folder + " is on a file system that is read only",
                        "sudo mount -o remount,rw $(findmnt -no TARGET --target " + folder + ")"});
  } else if (space && space->free_bytes < kEnough_bytes) {
    findings.push_back(
        {"state directory", Verdict::kFail,
         "the disk of " + folder + " is full: " + std::to_string(space->free_bytes >> 20) + " MiB are free",
         "sudo apt-get clean && sudo journalctl --vacuum-size=100M"});
  } else if (!space) {
    findings.push_back({"state directory", Verdict::kUnknown, "not known: how much room " + folder + " has"});
  } else {
    findings.push_back({"state directory", Verdict::kOk,
                        (status.error == 0 ? folder : "made at the first start") + ", " +
                            std::to_string(space->free_bytes >> 20) + " MiB are free"});
  }
}

/// Returns the hard limit in a line of /proc/PID/limits; nothing if there is no such line.
std::optional<double> limitOf(const std::string& limits, const std::string& name) {
  for (const std::string& line : linesOf(limits)) {
    if (line.rfind(name, 0) != 0) continue;
    const auto words = wordsOf(line.substr(name.size()));  // soft hard unit
    if (words.size() < 2) return std::nullopt;
    return words[1] == "unlimited" ? std::numeric_limits<double>::infinity() : std::strtod(words[1].c_str(), nullptr);
  }
  return std::nullopt;
}

std::string inWords(std::optional<double> limit) {
  return !limit ? "not known" : std::isinf(*limit) ? "no limit" : std::to_string(std::llround(*limit));
}

std::string editOf(const Instance& instance, const std::string& line) {
  return "sudo systemctl edit tractiond@" + instance.name + " with [Service] " + line +
         ", then sudo systemctl restart tractiond@" + instance.name;
}

/// Returns why an instance has no process.
std::string whyNotFound(const Patient& patient) {
  return patient.whyUnknown.empty() ? "the instance does not run" : patient.whyUnknown;
}

void checkLimits(const Patient& patient, const Instance& instance, List& findings) {
  if (instance.processes.empty()) {
    findings.push_back({"limits", Verdict::kUnknown, "not known: " + whyNotFound(patient)});
    return;
  }
  const std::string text = patient.box.read("/proc/" + std::to_string(instance.processes[0]) + "/limits").text;
  const auto files = limitOf(text, "Max open files"), memory = limitOf(text, "Max address space");
  if (!files || !memory) {
    findings.push_back({"limits", Verdict::kUnknown, "not known: those of the process may not be read"});
    return;
  }
  constexpr double kFewFiles = 4096.0, kLeastMemory = 2147483648.0;
  const auto edit = [&](const std::string& line) { return editOf(instance, line); };
  if (*memory < kLeastMemory) {
    findings.push_back(
        {"limits", Verdict::kFail, inWords(memory) + " bytes of address space", edit("LimitAS=infinity")});
  } else if (*files < kFewFiles) {
    findings.push_back({"limits", Verdict::kWarn, inWords(files) + " descriptors: each subscriber takes one",
                        edit("LimitNOFILE=65536")});
  } else {
    findings.push_back({"limits", Verdict::kOk, inWords(files) + " descriptors"});
  }
}

/// Returns whether a process has a capability, by the number of the capability and the text of /proc/PID/status.
bool isCapable(const std::string& status, unsigned capability) {
  const std::string key = "CapEff:";
  for (const std::string& line : linesOf(status)) {
    if (line.rfind(key, 0) == 0) return (std::strtoull(&line[key.size()], nullptr, 16) >> capability & 1U) != 0;
  }
  return false;
}

/// Returns the processors of a list such as "0-2,5".
std::set<int> cpusOf(const std::string& list) {
  std::set<int> cpus;
  std::istringstream items(list);
  for (std::string item; std::getline(items, item, ',');) {
    char* behind = nullptr;
    const long first = std::strtol(item.c_str(), &behind, 10);
    const long last = *behind == '-' ? std::strtol(behind + 1, nullptr, 10) : first;
    for (long cpu = first; cpu <= last; ++cpu) cpus.insert(static_cast<int>(cpu));
  }
  return cpus;
}

/// Compares the settings of [realtime] with the permissions of the running process.
void checkRealTime(const Patient& patient, const Instance& instance, List& findings) {
  const std::string check = "real time";
  if (!instance.settings) {
    findings.push_back({check, Verdict::kUnknown, "not known: " + instance.whyUnknown});
    return;
  }
  const Settings& asked = *instance.settings;
  if (asked.priority == 0 && asked.cpus.empty() && !asked.lockMemory) {
    findings.push_back({check, Verdict::kOk, "none is asked for"});
    return;
  }
  const std::set<int> wanted = cpusOf(asked.cpus),
                      there = cpusOf(patient.box.line("/sys/devices/system/cpu/online").value_or(""));
  if (!there.empty() && !std::includes(there.begin(), there.end(), wanted.begin(), wanted.end())) {
    const std::string online = *patient.box.line("/sys/devices/system/cpu/online");
    findings.push_back({check, Verdict::kWarn,
                        "realtime.cpus = \"" + asked.cpus + "\", and the processors are " + online,
                        "realtime.cpus of these in " + instance.file});
    return;
  }
  if (instance.processes.empty()) {
    findings.push_back({check, Verdict::kUnknown, "not known: " + whyNotFound(patient)});
    return;
  }
  constexpr unsigned kMayLock = 14, kMaySchedule = 23;  // CAP_IPC_LOCK, CAP_SYS_NICE
  const std::string folder = "/proc/" + std::to_string(instance.processes[0]);
  const std::string limits = patient.box.read(folder + "/limits").text;
  const std::string status = patient.box.read(folder + "/status").text;
  const auto priority = limitOf(limits, "Max realtime priority"), memory = limitOf(limits, "Max locked memory");
  if (!priority || !memory) {
    findings.push_back({check, Verdict::kUnknown, "not known: the limits of the process may not be read"});
    return;
  }
  std::string wrong, lines;
  const auto add = [&](const std::string& what, const std::string& line) {
    wrong += (wrong.empty() ? "" : "; ") + what;
    lines += (lines.empty() ? "" : " ") + line;
  };
  if (asked.priority > *priority && !isCapable(status, kMaySchedule))
    add("realtime.priority = " + std::to_string(asked.priority) + ", and " + inWords(priority) + " is allowed",
        "LimitRTPRIO=" + std::to_string(asked.priority));
  const std::string restricts =
      asked.priority > 0 ? shown(patient, "tractiond@" + instance.name + ".service")["RestrictRealtime"] : "no";
  if (restricts == "yes")
    add("realtime.priority = " + std::to_string(asked.priority) + ", and the unit's sandbox refuses all",
        "RestrictRealtime=no");
  if (asked.lockMemory && !std::isinf(*memory) && !isCapable(status, kMayLock))
    add("realtime.lock_memory, and " + inWords(memory) + " bytes are allowed", "LimitMEMLOCK=infinity");
  if (!wrong.empty())
    findings.push_back({check, Verdict::kWarn, wrong, editOf(instance, lines)});
  else if (restricts.empty())
    findings.push_back({check, Verdict::kUnknown, "not known: systemctl does not tell RestrictRealtime of the unit"});
  else
    findings.push_back({check, Verdict::kOk, "what is asked for is allowed"});
}

}  // namespace

void checkService(const Patient& patient, const Instance& instance, List& findings) {
  checkConfiguration(patient, instance, findings);
  checkUnit(patient, instance, findings);
  checkState(patient, instance, findings);
  checkLimits(patient, instance, findings);
  checkRealTime(patient, instance, findings);
}

}  // namespace traction::doctor

// Checks of the machine that tractiond runs on, and their findings.
#pragma once

#include "client/doctor/box.h"

#include <optional>
#include <string>
#include <vector>

namespace traction::doctor {

enum class Verdict { kOk, kUnknown, kWarn, kFail };

struct Finding {
  std::string check;  ///< "receive buffer"
  Verdict verdict = Verdict::kOk;
  std::string found;          ///< in words
  std::string mend = {};      ///< a command or a line of a configuration; empty: nothing is to be mended
  std::string instance = {};  ///< whose; empty: the whole box's
};

/// What an instance's configuration asks of its box.
struct Settings {
  std::string cameraId, packetSocket = "off";
  double receiveBuffer_bytes = 0.0, packetSize_bytes = 0.0;
  int priority = 0;  ///< realtime.*
  std::string cpus;
  bool lockMemory = false;
  std::vector<std::string> endpoints;  ///< of all kinds
};

struct Instance {
  std::string name;
  std::string file;                  ///< of its configuration
  std::optional<Settings> settings;  ///< none: not known
  std::string whyUnknown;
  std::vector<int> processes;  ///< of tractiond
};

/// What more than one check needs. Borrows the box.
struct Patient {
  const Box& box;
  std::string program;  ///< tractiond
  std::vector<Process> processes;
  std::vector<Instance> instances;
};

/// Collects the processes and the instances with their settings. The box must outlive the result.
/// \param program path of tractiond \param instance the only one to examine; empty: all
Patient admit(const Box& box, const std::string& program, const std::string& instance);

/// Returns the id of a user or group from a file like /etc/passwd or /etc/group; nothing if the name is not in it.
std::optional<std::uint32_t> idOf(const Box& box, const std::string& file, const std::string& name);

/// Returns whether a camera.id is an IP or MAC address.
bool isAddress(const std::string& cameraId);

/// Returns whether the machine has USB and some instance's camera is not given by an address.
bool mayUseUsb(const Patient& patient);

// Each appends its findings; they do not set Finding::instance.
void checkMachine(const Patient& patient, std::vector<Finding>& findings);
void checkNetwork(const Patient& patient, const Instance& instance, std::vector<Finding>& findings);
void checkAccess(const Patient& patient, std::vector<Finding>& findings);
void checkCompetitors(const Patient& patient, std::vector<Finding>& findings);
void checkService(const Patient& patient, const Instance& instance, std::vector<Finding>& findings);
void checkMeasurement(const Patient& patient, const Instance& instance, std::vector<Finding>& findings);

/// Carries out all checks, those of the machine first, then those of each instance. Parameters are those of admit().
std::vector<Finding> examine(const Box& box, const std::string& program, const std::string& instance);

/// Returns the report as text: one line per check, followed by one with what mends it.
std::string reportText(const std::vector<Finding>& findings);
/// Returns the report as JSON.
std::string reportJson(const std::vector<Finding>& findings);

/// Returns the program's exit code: 0 if nothing is wrong, 1 for warnings, 2 if a check fails.
int exitCodeOf(const std::vector<Finding>& findings);

}  // namespace traction::doctor

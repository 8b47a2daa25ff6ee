// What is looked at on a box, and what is found.
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

/// Everything that more than one check needs.
struct Patient {
  const Box& box;
  std::string program;  ///< tractiond
  std::vector<Process> processes;
  std::vector<Instance> instances;
};

/// \param program path of tractiond \param instance the only one to be looked at; empty: all
Patient admit(const Box& box, const std::string& program, const std::string& instance);

/// An id of the machine's own user, or of a group, by a file like /etc/passwd; none: there is none of the name.
std::optional<std::uint32_t> idOf(const Box& box, const std::string& file, const std::string& name);

/// camera.id is an address in a network.
bool isAddress(const std::string& cameraId);

/// Not all instances' cameras are in a network, and the machine has USB.
bool mayUseUsb(const Patient& patient);

// Each appends its findings.
void checkMachine(const Patient& patient, std::vector<Finding>& findings);
void checkNetwork(const Patient& patient, const Instance& instance, std::vector<Finding>& findings);
void checkAccess(const Patient& patient, std::vector<Finding>& findings);
void checkCompetitors(const Patient& patient, std::vector<Finding>& findings);
void checkService(const Patient& patient, const Instance& instance, std::vector<Finding>& findings);
void checkMeasurement(const Patient& patient, const Instance& instance, std::vector<Finding>& findings);

std::vector<Finding> examine(const Box& box, const std::string& program, const std::string& instance);

/// One line a check, and one more for what mends it.
std::string reportText(const std::vector<Finding>& findings);
std::string reportJson(const std::vector<Finding>& findings);

/// 0: nothing is wrong, 1: warnings, 2: something fails.
int exitCodeOf(const std::vector<Finding>& findings);

}  // namespace traction::doctor

// Checks the machine that tractiond runs on, and reports the findings.
#pragma once

#include "client/doctor/box.h"

#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace traction::doctor {

/// kUnknown: the check could not be carried out.
enum class Verdict { kOk, kUnknown, kWarn, kFail };

/// The result of one check.
struct Finding {
  std::string check;  ///< name of the check: "receive buffer"
  Verdict verdict = Verdict::kOk;
  std::string found;          ///< what was found, in words
  std::string mend = {};      ///< command or line of a configuration that corrects it; empty: nothing to correct
  std::string instance = {};  ///< name of the instance that it concerns; empty: the whole machine
};

// Each returns a finding of a check that add() names.
inline Finding ok(std::string found) {
  return {{}, Verdict::kOk, std::move(found)};
}
/// \param why the check could not be carried out
inline Finding unknown(const std::string& why) {
  return {{}, Verdict::kUnknown, "not known: " + why};
}
inline Finding warn(std::string found, std::string mend) {
  return {{}, Verdict::kWarn, std::move(found), std::move(mend)};
}
inline Finding fail(std::string found, std::string mend) {
  return {{}, Verdict::kFail, std::move(found), std::move(mend)};
}

/// Appends the finding of a check.
inline void add(std::vector<Finding>& findings, const char* check, Finding finding) {
  finding.check = check;
  findings.push_back(std::move(finding));
}

/// Requirements of an instance's configuration on its machine, in the words of `tractiond --print-config`.
struct Settings {
  std::string cameraId;
  double receiveBuffer_bytes = 0.0, packetSize_bytes = 0.0;  ///< as in the configuration
};

/// An instance of tractiond on the machine, whether or not it runs.
struct Instance {
  std::string name;
  std::string file;                  ///< path of its configuration, which need not exist
  std::optional<Settings> settings;  ///< none: not known
  std::string whyUnknown;            ///< why the settings are not known
};

/// The examined machine, with data that more than one check needs. Borrows the box.
struct Patient {
  const Box& box;
  std::string program;  ///< path of tractiond
  std::vector<Instance> instances;
};

/// Returns the names of the instances that have a configuration file, an enabled unit or a control socket; "default" if
/// there are none. Directories that cannot be read count as empty.
std::set<std::string> instancesOf(const Box& box);

/// Collects the instances with their settings. Runs `program` once for each instance, and waits for it, 10 s at most.
/// What cannot be found out is left empty: it has no errors. The box must outlive the result.
/// \param program path of tractiond
/// \param instance the only one to examine; empty: instancesOf()
Patient admit(const Box& box, const std::string& program, const std::string& instance);

/// Returns the id of a user or group from a file like /etc/passwd or /etc/group; nothing if the name is not in it or
/// the file cannot be read.
std::optional<std::uint32_t> idOf(const Box& box, const std::string& file, const std::string& name);

/// Returns whether a camera.id is an IPv4 or a MAC address (six pairs of hexadecimal digits with colons).
bool isAddress(const std::string& cameraId);

/// Returns whether the machine has USB and some instance's camera is not given by an address, or is not known.
bool mayUseUsb(const Patient& patient);

// The following append their findings, one or more for each check; they do not set Finding::instance. They have no
// errors: a check that cannot be carried out is a finding kUnknown, one that does not apply kOk. They change nothing on
// the machine; checkService() runs tractiond and systemctl by Box::run(), which may wait for 10 s each.

/// Checks frequency governor, time of day, the rule for cameras on USB, user and group tractiond, and whether the user
/// who runs it is in that group.
void checkMachine(const Patient& patient, std::vector<Finding>& findings);
/// Checks the link to a camera on the network: receive buffer, MTU, reverse path filter, NetworkManager.
void checkNetwork(const Patient& patient, const Instance& instance, std::vector<Finding>& findings);
/// Checks configuration and systemd unit of an instance. Asks the running daemon for its status, as Box::status() does,
/// and reports client::problems() as one finding: kOk without one, kWarn if forces are doubtful, kFail if there are no
/// valid forces, kUnknown if no daemon answers.
void checkService(const Patient& patient, const Instance& instance, std::vector<Finding>& findings);

/// Carries out all checks, those of the machine first, then those of each instance, in order of their names, and sets
/// Finding::instance of the latter. Blocks until they are done.
/// \param box need not outlive the result
/// \param program path of tractiond
/// \param instance the only one to examine; empty: all, as for admit()
std::vector<Finding> examine(const Box& box, const std::string& program, const std::string& instance);

/// Returns the report as text: one line per finding, in their order, with the verdict (OK, ?, WARN, FAIL), the
/// instance, the check and what was found, followed by one with the command that corrects it, if there is one. Each
/// line ends with a newline. Characters that are not printable become '?'.
std::string reportText(const std::vector<Finding>& findings);
/// Returns the report as one line of JSON without a line end: an object with the array `checks`, of objects with check,
/// instance, verdict ("ok", "unknown", "warn", "fail"), found and mend, and the number exit_code.
std::string reportJson(const std::vector<Finding>& findings);

/// Returns the program's exit code: 2 if some verdict is kFail, else 1 if some is kWarn, else 0, also for kUnknown.
int exitCodeOf(const std::vector<Finding>& findings);

}  // namespace traction::doctor

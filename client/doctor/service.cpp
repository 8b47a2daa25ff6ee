// Checks the service of an instance: configuration, systemd unit, what it publishes.

#include "client/doctor/checks.h"
#include "client/show/health.h"
#include "traction/v1/status.pb.h"

#include <map>

namespace traction::doctor {

namespace {

Finding checkConfiguration(const Patient& patient, const Instance& instance) {
  const std::string& file = instance.file;
  const Box::FileStatus status = patient.box.fileStatus(file);
  const auto text = patient.box.read(file);
  if (!text && text.error() == std::errc::no_such_file_or_directory) return ok("there is none: the defaults hold");
  const auto user = idOf(patient.box, "/etc/passwd", "tractiond"), group = idOf(patient.box, "/etc/group", "tractiond");
  const bool readable = (status.mode & 004U) != 0 || (group && status.group == *group && (status.mode & 040U) != 0) ||
                        (user && status.user == *user && (status.mode & 0400U) != 0);
  if (status.error == 0 && !readable) return fail("the user tractiond may not read " + file, "sudo chmod 644 " + file);
  if (!text) return unknown(file + ": " + text.error().message());
  const auto ran = patient.box.run({patient.program, "--instance", instance.name, "--config", file, "--check-config"});
  if (!ran) return unknown(patient.program + " cannot be run");
  if (ran->exitCode == 0) return ok(file + " is right");
  std::string why = ran->complaint.substr(0, ran->complaint.find('\n'));
  const std::string prefix = "tractiond: ";
  if (why.rfind(prefix, 0) == 0) why.erase(0, prefix.size());
  return fail(why, "sudoedit " + file + " && tractiond --check-config --config " + file);
}

/// Returns the pairs KEY=VALUE of `systemctl show`.
std::map<std::string, std::string> shown(const Patient& patient, const std::string& unit) {
  const auto ran =
      patient.box.run({"systemctl", "show", unit, "--property=LoadState,UnitFileState,ActiveState,Result,NRestarts"});
  std::map<std::string, std::string> values;
  if (!ran || ran->exitCode != 0) return values;
  for (const std::string& line : linesOf(ran->output)) {
    if (const auto equals = line.find('='); equals != std::string::npos)
      values[line.substr(0, equals)] = line.substr(equals + 1);
  }
  return values;
}

Finding checkUnit(const Patient& patient, const Instance& instance) {
  const std::string unit = "tractiond@" + instance.name;
  auto values = shown(patient, unit + ".service");
  if (values.empty()) return unknown("systemctl does not answer");
  if (values["LoadState"] != "loaded")
    return fail(
        "systemd does not know " + unit,
        "sudo cmake --install build/programs && sudo systemctl daemon-reload, or sudo apt-get install tractiond");
  if (values["ActiveState"] == "failed")
    return fail(unit + " has failed: " + values["Result"],
                "journalctl -u " + unit + " -p warning -n 20 tells why; then sudo systemctl restart " + unit);
  if (values["UnitFileState"] != "enabled")
    return warn(unit + " does not start with the machine", "sudo systemctl enable --now " + unit);
  if (values["ActiveState"] != "active" && values["ActiveState"] != "reloading")
    return warn(unit + " is " + values["ActiveState"], "sudo systemctl start " + unit);
  return ok(unit + " runs; started again " + values["NRestarts"] + " times by itself");
}

Finding checkMeasurement(const Patient& patient, const Instance& instance) {
  const auto status = patient.box.status(instance.name);
  if (!status) return unknown(status.error());
  const std::vector<client::Problem> problems = client::problems(*status->message);
  const client::Health health = client::healthOf(problems);
  std::string found;
  for (const client::Problem& one : problems) found += (found.empty() ? "" : "; ") + sentence(one);
  if (health == client::Health::kMeasuring) return ok("fields with valid forces are published");
  return {{},
          health == client::Health::kDoubtful ? Verdict::kWarn : Verdict::kFail,
          found,
          "tractionctl --instance " + instance.name + " status"};
}

}  // namespace

void checkService(const Patient& patient, const Instance& instance, std::vector<Finding>& findings) {
  add(findings, "configuration", checkConfiguration(patient, instance));
  add(findings, "service", checkUnit(patient, instance));
  add(findings, "measurement", checkMeasurement(patient, instance));
}

}  // namespace traction::doctor

#include "client/doctor/checks.h"
#include "client/show/health.h"
#include "traction/v1/status.pb.h"

namespace traction::doctor {

namespace {

Finding measurementOf(const Patient& patient, const Instance& instance) {
  if (instance.processes.empty() && patient.whyUnknown.empty()) return unknown("the instance does not run");
  const Box::Answer answer = patient.box.status(instance.name);
  if (!answer.status) return unknown(answer.why);
  const std::vector<client::Problem> problems = client::problems(*answer.status->message);
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

void checkMeasurement(const Patient& patient, const Instance& instance, std::vector<Finding>& findings) {
  add(findings, "measurement", measurementOf(patient, instance));
}

}  // namespace traction::doctor

#include "client/show/health.h"
#include "client/doctor/checks.h"
#include "traction/v1/status.pb.h"

namespace traction::doctor {

void checkMeasurement(const Patient& patient, const Instance& instance, std::vector<Finding>& findings) {
  const std::string check = "measurement";
  if (instance.processes.empty() && patient.whyUnknown.empty()) {
    findings.push_back({check, Verdict::kUnknown, "not known: the instance does not run"});
    return;
  }
  const Box::Answer answer = patient.box.status(instance.name);
  if (!answer.status) {
    findings.push_back({check, Verdict::kUnknown, "not known: " + answer.why});
    return;
  }
  const std::vector<client::Problem> problems = client::problems(*answer.status->message);
  const client::Health health = client::healthOf(problems);
  std::string found;
  for (const client::Problem& one : problems) found += (found.empty() ? "" : "; ") + sentence(one);
  if (health == client::Health::kMeasuring)
    findings.push_back({check, Verdict::kOk, "fields with valid forces are published"});
  else
    findings.push_back({check, health == client::Health::kDoubtful ? Verdict::kWarn : Verdict::kFail, found,
                        "tractionctl --instance " + instance.name + " status"});
}

}  // namespace traction::doctor

// Checks for instances that use the same camera.

#include "client/doctor/checks.h"

#include <algorithm>
#include <map>

namespace traction::doctor {

namespace {

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

}  // namespace

void checkCompetitors(const Patient& patient, std::vector<Finding>& findings) {
  add(findings, "a camera each", checkSharedCamera(patient));
}

}  // namespace traction::doctor

#include "client/src/paired_contacts.h"

#include <algorithm>
#include <utility>

namespace traction {
namespace {

/// Returns the end of a contact, without what holds only while it is seen.
TrackedContact endOf(TrackedContact contact, EndCause cause) {
  contact.phase = ContactPhase::kEnd;
  contact.endCause = cause;
  contact.force_N = contact.forceDeviation_N = contact.moment_Nm = {};
  contact.forceCovariance_N2 = contact.momentCovariance_N2m2 = contact.forceMomentCovariance_N2m = {};
  contact.velocity_m_s = contact.velocityDeviation_m_s = {};
  contact.angularVelocity_rad_s = contact.angularVelocityDeviation_rad_s = 0.0;
  contact.slip.reset();
  return contact;
}

auto find(auto& contacts, std::uint64_t id) {
  return std::find_if(contacts.begin(), contacts.end(), [&](const TrackedContact& each) { return each.id == id; });
}

}  // namespace

void PairedContacts::complete(Contacts& contacts) {
  std::vector<TrackedContact> all, open;
  for (const TrackedContact& each : open_.contacts) {
    const bool goesOn = contacts.run == open_.run && find(contacts.contacts, each.id) != contacts.contacts.end();
    if (goesOn) {
      open.push_back(each);
    } else {
      all.push_back(endOf(each, contacts.run == open_.run ? EndCause::kNotSeen : EndCause::kStopped));
    }
  }
  for (TrackedContact& each : contacts.contacts) {
    const auto before = find(open, each.id);
    const bool isSeen = each.phase == ContactPhase::kBegin || each.phase == ContactPhase::kMove;
    if (before == open.end() && !isSeen) continue;
    if (isSeen) each.phase = before == open.end() ? ContactPhase::kBegin : ContactPhase::kMove;
    all.push_back(each);
    if (each.phase == ContactPhase::kEnd) {
      open.erase(before);
    } else if (before == open.end()) {
      open.push_back(each);
    } else {
      *before = each;
    }
  }
  contacts.contacts = std::move(all);
  open_ = {contacts.header, contacts.run, contacts.valid, std::move(open), {}};
}

Contacts PairedContacts::endAll() {
  Contacts ends{open_.header, open_.run, false, {}, {}};
  for (const TrackedContact& each : open_.contacts) ends.contacts.push_back(endOf(each, EndCause::kNotSeen));
  open_.contacts.clear();
  return ends;
}

}  // namespace traction

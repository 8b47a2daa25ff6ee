// What this room reads of a field. Contacts are the structs of the client's public headers; all numbers are finite, as
// the client refuses others. Gel frame, SI units.
#pragma once

#include "traction/messages.h"

#include <cstdint>
#include <vector>

namespace touch {

using traction::ContactPhase, traction::Covariance, traction::EndCause, traction::Id;

/// What the numbers of a field are relative to. The contacts of two fields are comparable if it is the same in both.
struct Basis {
  Id boot{};         ///< start of the daemon
  Id calibration{};  ///< what the forces are computed from
  Id zero{};         ///< what displacements are measured from
  friend bool operator==(const Basis&, const Basis&) = default;
};

/// A contact as one field states it.
using Observation = traction::Contact;

/// Returns the time between two, in double precision, as the times of fields may be any.
inline double seconds(std::int64_t from_ns, std::int64_t to_ns) {
  return 1e-9 * (static_cast<double>(to_ns) - static_cast<double>(from_ns));
}

struct Field {
  std::int64_t time_ns = 0;  ///< of capture, or else of arrival; CLOCK_MONOTONIC of the daemon's host
  bool valid = false;        ///< false: nothing is known of this frame
  bool doubted = false;      ///< true: a flag says that errors may exceed what the deviations say
  Basis basis;
  std::vector<Observation> contacts;  ///< strongest first
};

}  // namespace touch

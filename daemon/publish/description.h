// Content of the description message: which daemon publishes, and what its numbers mean. The message itself is the
// record.
#pragma once

#include "daemon/records/marker_field.h"
#include "sensor/sensor.h"
#include "traction/v1/description.pb.h"

#include <string>

namespace tractiond::publish {

/// Part of every message: states which daemon sends it.
struct Identity {
  std::string sensor;  ///< name from the configuration; valid by traction::isValidName
  Id boot{};           ///< of this start of the daemon: randomId()
  Id calibration{};    ///< hash of what the forces are computed from
};

struct Description {
  Identity identity;
  /// Without header, topics and timestamp, which the publisher sets.
  traction::v1::Description message;
};

/// Returns the bytes of an id, as messages have them.
inline std::string bytesOf(const Id& id) {
  return {id.begin(), id.end()};
}

/// Returns 128 random bits.
Id randomId();

/// Returns the 16 bytes of the kernel's boot id; processes that share it share CLOCK_MONOTONIC. Empty without /proc.
std::string hostId();

/// Sets what a description says of a gel and its camera, except what computing has shown.
void describe(const sensor::Sensor& sensor, traction::v1::Description& message);

}  // namespace tractiond::publish

// Asks things of a running tractiond.
#pragma once

#include "traction/description.h"
#include "traction/error.h"
#include "traction/status.h"

#include <chrono>

namespace traction {

struct ControlOptions {
  std::string instance = "default";               ///< of tractiond, on this machine
  std::string endpoint;                           ///< ZeroMQ's, "tcp://HOST:9874"; empty: found by the instance
  std::chrono::milliseconds timeout{3000};        ///< for an answer
  std::chrono::milliseconds zeroTimeout{15'000};  ///< taking a zero needs frames of the camera
};

/// What came of zero().
struct ZeroResult {
  Zero zero;                          ///< what was taken
  std::uint32_t markersPresent = 0;   ///< found in the picture
  std::uint32_t markersExpected = 0;  ///< of the gel
  double noise_levels = 0.0;          ///< standard deviation of a pixel between the rest frames [grey levels]
};

/// Thread-safe: every request has a connection of its own.
class TRACTION_EXPORT Control {
 public:
  /// \throws Error kBadEndpoint
  explicit Control(const ControlOptions& options = {});

  // All of them \throw Error kNoAnswer, kVersion, kMalformed, kRefused.
  Status status() const;            ///< the last one published
  Description description() const;  ///< the last one published
  /// Takes what the camera sees now as the unloaded gel, and waits for it.
  ZeroResult zero() const;

  /// Where it asks; for messages to people.
  const std::string& endpoint() const { return options_.endpoint; }

 private:
  ControlOptions options_;
};

}  // namespace traction

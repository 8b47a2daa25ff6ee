// How the daemons of this machine do, as Prometheus reads it.
#pragma once

#include "traction/control.h"

#include <optional>
#include <string>
#include <vector>

namespace traction::cli {

/// One instance, asked: none where it did not answer.
struct Measured {
  std::string instance;
  std::optional<Status> status;
};

/// Prometheus's text format 0.0.4.
std::string metricsText(const std::vector<Measured>& all);

/// Prints the metrics of this instance, or of all on this machine where `one` is false. `http`: as the answer to the
/// request on standard input, for a socket of systemd. Whoever does not answer is down, which is no error.
/// \throws OutputError
void metrics(const ControlOptions& options, bool one, bool http);

}  // namespace traction::cli

// Reports the state of this machine's daemons to Prometheus.
#pragma once

#include "traction/control.h"

#include <optional>
#include <string>
#include <vector>

namespace traction::cli {

/// One instance; `status` is empty if it did not answer.
struct Measured {
  std::string instance;
  std::optional<Status> status;
};

/// Returns Prometheus's text format 0.0.4.
std::string metricsText(const std::vector<Measured>& all);

/// Prints the metrics of one instance, or of all on this machine if `one` is false. An instance that does not answer is
/// reported as down, which is not an error. \param http true: answers the HTTP request on standard input, for a socket
/// unit of systemd
/// \throws OutputError
void metrics(const ControlOptions& options, bool one, bool http);

}  // namespace traction::cli

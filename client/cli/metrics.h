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

/// Returns the metrics in Prometheus's text format 0.0.4, with the label instance. An instance without a status has one
/// metric, traction_up 0.
std::string metricsText(const std::vector<Measured>& all);

/// Prints the metrics of one instance, or of all on this machine if `one` is false. An instance that gives no status,
/// for any reason, is reported as down, which is not an error. Asks one instance after another, and waits for each at
/// most `options.timeout`, with `one` false 1 s, to connect and as long again for the answer. \param http true: waits
/// for an HTTP request on standard input, reads it up to its empty line, and prints an answer with the metrics whatever
/// it asks for; for a socket unit of systemd \throws OutputError
void metrics(const ControlOptions& options, bool one, bool http);

}  // namespace traction::cli

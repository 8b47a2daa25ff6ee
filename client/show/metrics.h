// Reports the state of this machine's daemons to Prometheus.
#pragma once

#include "traction/control.h"

#include <optional>
#include <string>
#include <vector>

namespace traction::client {

/// One instance; `status` is empty if it did not answer.
struct Measured {
  std::string instance;
  std::optional<Status> status;
};

/// Returns the metrics in Prometheus's text format 0.0.4, with the label instance. An instance without a status has one
/// metric, traction_up 0.
std::string metricsText(const std::vector<Measured>& all);

}  // namespace traction::client

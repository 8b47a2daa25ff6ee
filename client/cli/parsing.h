// Options that several commands have.
#pragma once

#include <CLI/CLI.hpp>

#include <limits>

namespace traction::client {

/// Returns a check for a duration from 0 to 10^9 s.
CLI::Validator timeSpan();

/// Duration of a command that ends on a signal only [s].
constexpr double kForever = std::numeric_limits<double>::infinity();

/// Adds the option --seconds to a command that otherwise runs until a key or a signal ends it.
void addSeconds(CLI::App& command, double& seconds);

}  // namespace traction::client

// Guides an operator, or a script, through the calibration of a sensor.
#pragma once

#include "traction/control.h"

#include <optional>
#include <string>
#include <vector>

namespace traction::cli {

struct CalibrateOptions {
  std::vector<std::string> steps;  ///< of geometry, noise, weights, finish; empty: all
  std::vector<double> weights_N;   ///< in the order in which they are put on [N]; not empty if the step weights runs
  /// Longest wait for each weight; duration of the noise step, if the step weights does not run. 0: the daemon's
  /// default
  double seconds = 0.0;
  std::string name;       ///< name of the gel, for the file: 1 to 24 of A-Z a-z 0-9 _ -; empty: gel
  bool keepZero = false;  ///< true: geometry uses the zero in force; false: takes a new one
  bool anyway = false;    ///< true: proceeds even if something seems to touch the gel
  bool yes = false;       ///< true: does not wait for Enter
  bool json = false;
};

/// Parses a list of weights and returns newtons: "100gf,200gf,5N". Units: gf (or g, as a mass), kgf, mN and N. Returns
/// nothing if it is not such a list, is empty, or has a weight that is not above 0 and at most 10^6 N.
std::optional<std::vector<double>> parseWeights(const std::string& text);

/// Runs the steps, always in the order geometry, noise, weights, finish, and prints instructions and reports on
/// standard output, with `json` only the reports, one line of JSON each. The step weights reads each weight, and then
/// estimates the stiffness. Waits for Enter after each instruction if standard input is a terminal and `options.yes` is
/// false; the instruction is then printed with `json` as well, on standard error. Blocks until they are done; a step
/// that fails ends it, and keeps what the steps before it did. \throws Error as Control::calibrate() and
/// Control::zero() if a step fails, kNoAnswer before the first instruction if no daemon answers; OutputError if
/// standard output cannot be written
void calibrate(const ControlOptions& control, const CalibrateOptions& options);

}  // namespace traction::cli

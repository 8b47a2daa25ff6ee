// Leads a person, or a script, through the calibration of a sensor.
#pragma once

#include "traction/control.h"

#include <optional>
#include <string>
#include <vector>

namespace traction::cli {

struct CalibrateOptions {
  std::vector<std::string> steps;  ///< of geometry, noise, weights, finish; empty: all of them
  std::vector<double> weights_N;   ///< to be put on in this order
  double seconds = 0.0;            ///< to look for noise, to wait for each weight; 0: as the daemon thinks right
  std::string name;                ///< of the gel, for the file
  bool keepZero = false;           ///< geometry from the zero in force; else a new one is taken
  bool anyway = false;             ///< also if something seems to touch
  bool yes = false;                ///< do not wait for Enter
  bool json = false;
};

/// "100gf,200gf,5N" -> newtons; gf (or g, of a mass), kgf, mN and N. Nothing where that is no list of weights.
std::optional<std::vector<double>> parseWeights(const std::string& text);

/// Waits for Enter before each step only where standard input is a terminal. \throws Error
void calibrate(const ControlOptions& control, const CalibrateOptions& options);

}  // namespace traction::cli

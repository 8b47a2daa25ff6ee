// The gel of the simulation: small, so that a field costs some microseconds.
#pragma once

#include "daemon/solve/options.h"
#include "daemon/track/nominal.h"
#include "sensor/sensor.h"

#include <vector>

namespace tractiond::simulation {

inline constexpr double kNoise_px = 0.018;
inline constexpr const char* kCamera = "Simulated-1";
inline constexpr const char* kState = "/state";

/// Immutable once made.
struct Gel {
  /// Takes the mechanics of a half-space, and draws the noise that pictures have.
  Gel();

  sensor::Sensor sensor;
  solve::SolveOptions options;
  std::vector<track::Vector> places;       ///< of the markers at rest [px]
  Eigen::VectorXd press;                   ///< displacements of a press of 1 N in the middle [px]
  std::vector<std::vector<float>> noises;  ///< of all coordinates [px]
};

}  // namespace tractiond::simulation

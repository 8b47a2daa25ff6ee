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
  Eigen::MatrixXf influence;               ///< H, 2M x 3N [px/N]
  Eigen::MatrixXf inverse;                 ///< forces by least squares, 3N x 2M [N/px]
  Eigen::VectorXf deviation;               ///< of each force by noise of 1 px [N]
  Eigen::Matrix<double, 6, 6> covariance;  ///< of resultant and moment by noise of 1 px
  std::vector<track::Vector> places;       ///< of the markers at rest [px]
  Eigen::VectorXd press;                   ///< displacements of a press of 1 N in the middle [px]
  std::vector<std::vector<float>> noises;  ///< of all coordinates [px]

 private:
  void invert(const Eigen::MatrixXd& exact);
};

}  // namespace tractiond::simulation

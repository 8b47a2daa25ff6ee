// The part of a force's uncertainty that is the same in every frame.
#pragma once

#include "daemon/records/traction_field.h"
#include "daemon/solve/factors.h"
#include "sensor/sensor.h"

namespace tractiond::solve {

/// Inverse::systematicErrors of `inverse`, which is the sensor's.
SystematicErrors systematicErrors(const sensor::Sensor& sensor, const SolveOptions& options, const Inverse& inverse);

/// The same of factors of the sensor's atoms. The whole face is read by all points, with the force of each expected to
/// be SolveOptions::shapeForce_N.
SystematicErrors systematicErrors(const sensor::Sensor& sensor, const SolveOptions& options, const Factors& factors,
                                  const Atoms& atoms);

/// Whether Young's modulus was measured with weights, and not before the camera's pose: then what would misread a press
/// is part of it.
bool isWeighed(const sensor::Sensor& sensor);

/// Covariance of the wrench (Fx .. Mz): by Young's modulus, what else the mechanics err by, and the two arrays of
/// SystematicErrors for a contact, or for the whole face. \param at where the force is [m]
WrenchCovariance systematicCovariance(const std::array<double, 6>& wrench, const Eigen::Vector3d& at,
                                      const sensor::Uncertainty& uncertainty, double pitch_m,
                                      std::span<const double> errors, std::span<const double> scatter);

}  // namespace tractiond::solve

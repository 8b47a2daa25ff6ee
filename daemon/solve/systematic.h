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

/// Returns the covariance of the wrench (Fx .. Mz): by Young's modulus, by what else the mechanics err by, and by
/// `errors`. \param at where the force is [m] \param whole share of the whole face in how it is read; the rest is a
/// contact's
WrenchCovariance systematicCovariance(const std::array<double, 6>& wrench, const Eigen::Vector3d& at,
                                      const sensor::Uncertainty& uncertainty, double pitch_m,
                                      const SystematicErrors& errors, double whole);

}  // namespace tractiond::solve

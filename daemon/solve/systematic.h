// Computes the part of a force's uncertainty that is the same in every frame.
#pragma once

#include "daemon/records/traction_field.h"
#include "daemon/solve/factors.h"
#include "sensor/sensor.h"

namespace tractiond::solve {

/// Computes Factors::systematicErrors of the factors of the sensor's atoms. Takes seconds for a block. Reentrant.
SystematicErrors systematicErrors(const sensor::Sensor& sensor, const SolveOptions& options, const Factors& factors,
                                  const Atoms& atoms);

/// Returns whether Young's modulus was measured with weights, and not before the camera's pose (by Calibration's dates;
/// the pose may never have been measured): errors of the camera and the mechanics that scale a normal force are then
/// compensated by it.
bool isWeighed(const sensor::Sensor& sensor);

/// Returns the covariance of a wrench [N, N m] about the origin, (Fx .. Mz), 6 x 6, row after row, by the errors of
/// Young's modulus, of the mechanics, and by `errors`. \param at place of the force [m], gel frame \param whole share
/// of SystematicErrors::wholeFace, 0 to 1; the rest is that of SystematicErrors::contact
WrenchCovariance systematicCovariance(const std::array<double, 6>& wrench, const Eigen::Vector3d& at,
                                      const sensor::Uncertainty& uncertainty, double pitch_m,
                                      const SystematicErrors& errors, double whole);

}  // namespace tractiond::solve

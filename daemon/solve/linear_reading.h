// Computes how a load is read if the solver is taken for linear: the matrix from displacements to the wrench.
#pragma once

#include "daemon/solve/atoms.h"
#include "daemon/solve/factors.h"
#include "sensor/sensor.h"

#include <Eigen/Core>

#include <array>

namespace tractiond::solve {

/// A matrix from displacements [px] to force and moment about the origin [N, N m], 6 x 2M.
using Reading = Eigen::MatrixXd;

/// How loads along each of the three axes at one place are read.
using Readings = std::array<Reading, 3>;

/// Returns how a load on the whole face is read: by all atoms, with forces of 9 mN expected of each. Takes a second.
/// Reentrant.
Reading wholeFaceReading(const Factors& factors, const Atoms& atoms, double noise_px);

/// Returns how a small contact at each of `nodes` is read under a force of Factors::force_N. Where patches are possible
/// it is read as one round patch: its loads, place and spread, its roughness, and the picture's motion, linear about
/// the patch (docs/mathematics.md, 4.4); elsewhere by the nodes within three places in the grid, alike for all three
/// axes. Takes some 0.1 s for a node. Reentrant.
/// \param mechanicsError as in SystematicErrors
std::vector<Readings> contactReadings(const sensor::Sensor& sensor, const Factors& factors, const Atoms& atoms,
                                      double noise_px, double mechanicsError, const std::vector<int>& nodes);

}  // namespace tractiond::solve

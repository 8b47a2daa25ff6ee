// Where the markers of a block are, by its rest picture: layers that are made by hand scatter about their grids.
//
// The picture shows the places in the planes of the layers. Depths are those of the gel file.
#pragma once

#include "daemon/solve/factors.h"

#include <cstdint>
#include <span>

namespace tractiond::solve {

/// What a rest picture shows.
struct RestPlaces {
  sensor::Points scatter;  ///< Sensor::scatter, depths 0; 0 of markers that are not counted in `measured`
  int measured = 0;        ///< markers
  int missing = 0;         ///< markers that the rest picture lacks
  int implausible = 0;     ///< markers that seem to lie farther than half a pitch from the grid
  double rms_m = 0.0;      ///< root mean square of a coordinate of the measured ones
};

/// Measures the places by the sensor's camera. Shift, scale and roll of the whole picture against the gel file are
/// taken for motion of the camera, and are not part of the scatter; with fewer than ten markers they are not estimated.
/// Sensor::scatter is not used. Cannot fail. Reentrant; milliseconds.
/// \param sensor a block (asserted)
/// \param place_px 2M, as in RestPose
/// \param present M (asserted), 0 or 1
RestPlaces restPlaces(const sensor::Sensor& sensor, std::span<const float> place_px,
                      std::span<const std::uint8_t> present);

/// Computes the influence of a block's points on its markers at the places of sensor.scatter, 2M x 3P [px/N], from
/// `drawn`, the factors of the same sensor without scatter. A half-space's displacements are exact; what the block adds
/// is smooth, and is interpolated between the markers of a layer.
/// `sensor.scatter` must not be empty.
Eigen::MatrixXd influenceAtPlaces(const sensor::Sensor& sensor, const Atoms& atoms, const Factors& drawn);

}  // namespace tractiond::solve

// Computes the rest picture from the sensor's description: what the tracker starts from. Reentrant.
#pragma once

#include "base/error.h"
#include "base/pixel_format.h"
#include "daemon/track/lattice.h"
#include "sensor/sensor.h"

#include <tl/expected.hpp>

#include <span>
#include <vector>

namespace tractiond::track {

/// Checks whether the tracker can follow the sensor's markers. Fails with EX_CONFIG for no or more than two layers, two
/// of the same contrast that have one colour or of which one is grey, a grid below 4 x 4, markers with a radius in the
/// picture below 1 px or above MarkerTemplate::largestRadius(), and a mean spacing along the first row or the first
/// column below 1.75 of their diameters.
tl::expected<void, Error> trackable(const sensor::Sensor& sensor);

/// Checks whether the tracker can follow them in pictures of this format. Fails with EX_CONFIG for two layers that only
/// colours tell apart, in a grey picture. Does not repeat the checks of trackable(sensor).
tl::expected<void, Error> trackable(const sensor::Sensor& sensor, PixelFormat format);

/// Returns the places of all markers of the untouched gel in the picture [px] by the gel file, in the order of
/// sensor::markerPositions. They may lie outside the picture.
std::vector<Vector> nominalPlaces(const sensor::Sensor& sensor);

/// Returns the radius of a layer's markers in the picture [px]: of the circle with the area of a marker in the middle
/// of the layer.
double markerRadius(const sensor::Sensor& sensor, const sensor::MarkerLayer& layer);

/// Returns the smallest of the lattices' mean distances between neighbours [px], of those in their first row and of
/// those in their first column: they differ where the pixels are not square or the camera is tilted.
/// \param places_px by marker of all layers
/// \param lattices at least one, of two columns and two rows or more
float smallestSpacing(std::span<const Vector> places_px, std::span<const Lattice> lattices);

}  // namespace tractiond::track

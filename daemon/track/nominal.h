// Computes the rest picture from the sensor's description: what the tracker starts from. Reentrant.
#pragma once

#include "base/error.h"
#include "daemon/records/pixel_format.h"
#include "daemon/track/lattice.h"
#include "sensor/sensor.h"

#include <tl/expected.hpp>

#include <span>
#include <vector>

namespace tractiond::track {

/// Checks whether the tracker can follow the sensor's markers. Fails for more than two layers or two that look alike, a
/// grid below 4 x 4, and markers with a radius below a pixel's width or so large or close that their windows meet.
tl::expected<void, Error> trackable(const sensor::Sensor& sensor);

/// Checks whether the tracker can follow them in pictures of this format. Fails for two layers that only colours tell
/// apart, in a grey picture.
tl::expected<void, Error> trackable(const sensor::Sensor& sensor, PixelFormat format);

/// Returns the places of all markers in the picture [px].
std::vector<Vector> nominalPlaces(const sensor::Sensor& sensor);

/// Returns the radius of a layer's markers in the picture [px].
double markerRadius(const sensor::Sensor& sensor, const sensor::MarkerLayer& layer);

/// Returns the smallest distance between neighbours in a lattice [px].
float smallestSpacing(std::span<const Vector> places_px, std::span<const Lattice> lattices);

}  // namespace tractiond::track

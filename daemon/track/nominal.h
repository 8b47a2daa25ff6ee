// The rest picture by the sensor's description, from which the tracker starts.
#pragma once

#include "base/error.h"
#include "daemon/records/pixel_format.h"
#include "daemon/track/lattice.h"
#include "sensor/sensor.h"

#include <tl/expected.hpp>

#include <span>
#include <vector>

namespace tractiond::track {

/// Fails if the tracker cannot track the sensor: more than two layers, or two that look alike; a grid below 4 x 4;
/// markers with a radius below one pixel, or so large or close that their windows overlap.
tl::expected<void, Error> trackable(const sensor::Sensor& sensor);

/// Fails also if it cannot track pictures of this format: two layers that differ in colour alone, in a grey picture.
tl::expected<void, Error> trackable(const sensor::Sensor& sensor, PixelFormat format);

/// Returns the places of all markers [px].
std::vector<Vector> nominalPlaces(const sensor::Sensor& sensor);

/// Returns the radius of a layer's markers in the picture [px].
double markerRadius(const sensor::Sensor& sensor, const sensor::MarkerLayer& layer);

/// Returns the smallest distance between neighbours of a lattice [px].
float smallestSpacing(std::span<const Vector> places_px, std::span<const Lattice> lattices);

}  // namespace tractiond::track

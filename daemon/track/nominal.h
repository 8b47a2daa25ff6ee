// The rest picture as the sensor's description has it: what the tracker starts from.
#pragma once

#include "base/error.h"
#include "daemon/records/pixel_format.h"
#include "daemon/track/lattice.h"
#include "sensor/sensor.h"

#include <tl/expected.hpp>

#include <span>
#include <vector>

namespace tractiond::track {

/// What the tracker cannot do: more than two layers or two that look alike, a grid below 4 x 4, markers smaller than a
/// pixel's width in radius or so large or close that their windows meet.
tl::expected<void, Error> trackable(const sensor::Sensor& sensor);

/// What it cannot do with pictures of this format: two layers that only colours tell apart, in a grey picture.
tl::expected<void, Error> trackable(const sensor::Sensor& sensor, PixelFormat format);

/// Of all markers [px].
std::vector<Vector> nominalPlaces(const sensor::Sensor& sensor);

/// In the picture [px].
double markerRadius(const sensor::Sensor& sensor, const sensor::MarkerLayer& layer);

/// Between neighbours in the lattice where that is least [px].
float smallestSpacing(std::span<const Vector> places_px, std::span<const Lattice> lattices);

}  // namespace tractiond::track

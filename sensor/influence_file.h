// The influence file: a body of any shape, given by its own Green's functions. docs/influence-file.md shows how to
// write one.
#pragma once

#include "base/toml_table.h"
#include "sensor/sensor.h"

#include <tl/expected.hpp>

#include <string>

namespace sensor {

using tractiond::FileError;

/// Reads an influence file. Fails if numpy.savez() did not write it, if an array is missing, not finite or of
/// inconsistent shape, and if the matrix has the wrong sign or unit for a body of its stiffness.
tl::expected<Body, FileError> loadBody(const std::string& path);

/// Gives the sensor a body. Sets the pitch, centre and depth of each layer, and the centre of the nodes, to the body's
/// means, and the nodes' pitch to the square root of their mean area. Fails, without a change, if the body's number of
/// markers or nodes differs from the sensor's, or a marker lies beyond the gel's thickness.
tl::expected<void, FileError> setBody(Sensor& sensor, Body body);

}  // namespace sensor

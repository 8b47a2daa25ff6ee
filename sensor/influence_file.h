// The influence file: a body of any shape by its own Green's functions. docs/influence-file.md shows how to write one.
#pragma once

#include "sensor/sensor.h"
#include "sensor/toml_table.h"

#include <tl/expected.hpp>

#include <string>

namespace sensor {

/// Fails for what numpy.savez() did not write, where an array is missing, not finite or of another shape than the
/// others ask for, and where the matrix has the wrong sign or unit for a body of its stiffness.
tl::expected<Body, FileError> loadBody(const std::string& path);

/// Gives the sensor the body: grids, spacings and depths of layers and nodes become the body's means. Fails where it
/// has not as many markers and nodes as the sensor's layers and node grid, or markers beyond the gel's thickness.
tl::expected<void, FileError> setBody(Sensor& sensor, Body body);

}  // namespace sensor

// The influence file: a body of any shape, given by its own Green's functions. docs/influence-file.md shows how to
// write one.
#pragma once

#include "base/toml_table.h"
#include "sensor/sensor.h"

#include <tl/expected.hpp>

#include <string>

namespace sensor {

using tractiond::FileError;

/// Reads an influence file into memory. Fails if numpy.savez() did not write it, if its format or units are unknown, if
/// an array is missing, not finite or of inconsistent shape, if modulus or an area is not above 0, if a normal is not
/// of length 1 (to 1e-3) or the normals point out of the body, and if the matrix is all zero or has the wrong sign or
/// unit for a body of its stiffness. Scales the normals to length 1. The error has `unreadable` if the file cannot be
/// read, else `isData`.
tl::expected<Body, FileError> loadBody(const std::string& path);

/// Gives the sensor a body. Sets the pitch, centre and depth of each layer, and the centre of the nodes, to the body's
/// means (the pitch of a single marker to 0), and the nodes' pitch to the square root of their mean area. Leaves
/// Young's modulus and size of the gel unchanged. Fails (`isData`), without a change, if the body's number of markers
/// or nodes differs from the sensor's, or the z of a marker is not smaller than the gel's thickness.
/// \param sensor with the counts of layers and nodes
tl::expected<void, FileError> setBody(Sensor& sensor, Body body);

}  // namespace sensor

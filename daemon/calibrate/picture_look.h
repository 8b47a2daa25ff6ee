// How a camera may show a gel other than its file has it: turned, mirrored, with the layers' colours exchanged.
#pragma once

#include "daemon/records/gel_report.h"
#include "sensor/sensor.h"

#include <span>
#include <string>

namespace tractiond::calibrate {

/// What a picture shows of the second layer against the first: x and y of its centre, and its depth, gel frame [m].
struct BetweenLayers {
  Eigen::Vector3d difference, deviation;
};

/// Returns a sentence that names the looks of the file's gel which agree with the picture within five deviations, and
/// what to do about each. Turned by quarters, mirrored and exchanged are tried; those that need less come alone. Empty:
/// none agrees, or the gel is a body, whose markers' order says nothing. Reentrant.
/// \param seen one per layer; empty: not known
std::string otherLook(const sensor::Sensor& file, std::span<const LatticeSeen> seen, const BetweenLayers& between);

/// Returns whether a mirrored picture of the gel may look like one that is turned at most: then no picture tells of a
/// mirrored one, whose forces are mirrored, too. True of a body, whose form is not compared.
bool mayBeMirrored(const sensor::Sensor& sensor);

}  // namespace tractiond::calibrate

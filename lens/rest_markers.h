// Finds and labels the markers of an untouched gel in one picture, with the daemon's tracker.
#pragma once

#include "base/error.h"
#include "daemon/records/gel_report.h"
#include "sensor/sensor.h"

#include <opencv2/core.hpp>
#include <tl/expected.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace lens {

/// Markers in the order of sensor::markerPositions. M = their number.
struct RestMarkers {
  std::vector<float> place_px;        ///< 2 M, (u, v); interpolated from neighbours if not present
  std::vector<std::uint8_t> present;  ///< M, 0 or 1
  /// By layer: columns and rows that the picture shows, whatever the sensor has.
  std::vector<tractiond::LatticeSeen> seen;

  /// Returns the number of markers that are present.
  int count() const;
};

/// Finds the markers of an untouched gel. Tries the sensor's pose first. If fewer than nine tenths of the markers are
/// found from there, also tries a pose that is estimated from the picture: from the spacing, place and roll of the grid
/// of spots that it shows, or, if the spots form no grid, by matchDots(). Returns the result with more markers, which
/// may lack some.
///
/// Fails with EX_DATAERR if too few markers are found in their order from each pose, or if the tracker cannot find such
/// markers in any picture. The error states the reason, with the daemon's diagnosis, and the remedy, without the
/// picture's name. Reentrant.
/// \param picture 8 bits, grey or BGR, of the size of the sensor's camera (asserted)
tl::expected<RestMarkers, tractiond::Error> findMarkers(const cv::Mat& picture, const sensor::Sensor& sensor);

}  // namespace lens

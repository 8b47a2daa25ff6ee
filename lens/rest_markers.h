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

/// Finds the markers of an untouched gel. The sensor's pose is tried first; if that shows fewer than nine tenths of the
/// markers, the distance, place and roll at which the picture's own grid of spots would look as it does, or, where spots form no
/// grid, at which most markers lie on one. The error
/// (EX_DATAERR) states the reason and the remedy, without the picture's name: markers that the tracker cannot find in
/// such a picture, or too few of them in their order, with the daemon's diagnosis. Neither argument need outlive the
/// result. Reentrant. \param picture 8 bits, grey or BGR, of the size of the sensor's camera (asserted)
tl::expected<RestMarkers, tractiond::Error> findMarkers(const cv::Mat& picture, const sensor::Sensor& sensor);

}  // namespace lens

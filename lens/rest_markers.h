// The markers of an untouched gel in one picture, found and told from each other by the daemon's own tracker.
#pragma once

#include "daemon/base/error.h"
#include "sensor/sensor.h"

#include <opencv2/core.hpp>
#include <tl/expected.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace lens {

/// M = number of markers, in the order of sensor::markerPositions.
struct RestMarkers {
  std::vector<float> place_px;        ///< 2 M, (u, v); where not present, the neighbours' guess
  std::vector<std::uint8_t> present;  ///< M, 0 or 1

  int count() const;
};

/// \param picture 8 bits, grey or BGR. The error says why not and what to do, for people; it does not name the picture.
tl::expected<RestMarkers, tractiond::Error> findMarkers(const cv::Mat& picture, const sensor::Sensor& sensor);

}  // namespace lens

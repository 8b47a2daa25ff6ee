// What a person asks of traction-lens. Each prints to standard output and writes its file last, whole or not at all.
#pragma once

#include "daemon/base/error.h"
#include "lens/chessboard.h"
#include "sensor/sensor.h"

#include <tl/expected.hpp>

#include <string>
#include <vector>

namespace lens {

/// Everything that is wrong with what was given, one line each; at least one.
using Faults = std::vector<tractiond::Error>;
using Done = tl::expected<void, Faults>;

struct CalibrateOptions {
  std::vector<std::string> pictures;  ///< files
  Board board;
  std::string gel;     ///< file that the lens is written into; empty: the paper's sensor
  std::string output;  ///< file
};

/// The lens from pictures of a chessboard.
Done calibrate(const CalibrateOptions& options);

/// A gel file, or the paper's sensor for an empty path.
tl::expected<sensor::Sensor, Faults> loadGel(const std::string& path);

/// `remark`: one line on where the numbers come from. A calibration in force is taken out: its numbers have changed.
Done writeGel(const std::string& path, sensor::Sensor sensor, const std::string& remark);

/// A fault of the data.
tractiond::Error fault(const std::string& where, std::string what, std::string remedy = "");

/// One line of a table: name, value, and its deviation where that is not negative.
void printFigure(const char* name, double value, double deviation, const char* unit);

}  // namespace lens

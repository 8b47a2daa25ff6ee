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
  /// File that the lens is written into; empty: the paper's sensor. Where it leaves the picture's size out, that is the
  /// pictures'.
  std::string gel;
  std::string output;  ///< file
};

/// The lens from pictures of a chessboard.
Done calibrate(const CalibrateOptions& options);

struct PictureOptions {
  std::string picture;  ///< file
  std::string gel;      ///< file
  std::string output;   ///< file: a gel file or a PNG picture
};

struct PoseOptions : PictureOptions {
  double acceptResidual_px = 0.5;  ///< a good pattern leaves hundredths; a pose that leaves more is refused
};

/// The camera's pose from one picture of the untouched gel, into a gel file.
Done pose(const PoseOptions& options);

/// The picture with the markers that were found.
Done mark(const PictureOptions& options);

struct SheetsOptions {
  std::string gel;        ///< file; empty: the paper's
  std::string directory;  ///< made if it is not there; empty: this one
  bool mirrored = false;
};

/// layer1.svg, layer2.svg ...: what is to be printed.
Done writeSheets(const SheetsOptions& options);

/// A gel file, or the paper's sensor for an empty path.
tl::expected<sensor::Sensor, Faults> loadGel(const std::string& path);

/// A gel file, and whether it says how large the picture is; what it leaves out is as the paper's.
struct CameraFile {
  sensor::Sensor sensor;
  bool hasWidth = false, hasHeight = false;
};
tl::expected<CameraFile, Faults> loadCamera(const std::string& path);

/// `remark`: one line on where the numbers come from. A calibration in force is taken out: its numbers have changed.
Done writeGel(const std::string& path, sensor::Sensor sensor, const std::string& remark);

/// A fault of the data.
tractiond::Error fault(const std::string& where, std::string what, std::string remedy = "");

/// One line of a table: name, value, and its deviation where that is not negative.
void printFigure(const char* name, double value, double deviation, const char* unit);

}  // namespace lens

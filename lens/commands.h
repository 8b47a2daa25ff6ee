// The commands of traction-lens. Each reports what it finds, and writes its file last and atomically; an existing
// picture or sheet is replaced, a gel file only if asked for, as it may have been edited. On failure nothing is written
// (but see writeSheets()); the program ends with the first error's code.
#pragma once

#include "base/error.h"
#include "lens/chessboard.h"
#include "lens/report.h"
#include "sensor/sensor.h"

#include <tl/expected.hpp>

#include <string>
#include <vector>

namespace lens {

using Done = tl::expected<void, Faults>;

struct CalibrateOptions {
  std::vector<std::string> pictures;  ///< files, at least five, all of one size
  Board board;
  bool boardIsMeasured = false;  ///< both sides of the squares are known
  bool fisheye = false;          ///< the lens is a fisheye; it is one, too, if the gel file's is
  /// Gel file that the lens is written into; empty: the paper's sensor. If it does not state the picture's size, the
  /// size of the pictures is used.
  std::string gel;
  std::string output;  ///< file
  bool force = false;  ///< replaces an existing file
};

/// Estimates the lens from pictures of a chessboard and writes a gel file with its uncertainties. The gel file's pose
/// is kept; its aspect, too, unless the pictures contradict it and tell that it is not the board. Errors: those of
/// loadGel() and readPicture(); EX_DATAERR for each picture that shows no board or differs from the others in size,
/// sharpness or lens, for too few pictures, for another size than the gel file's, and if the pictures do not determine
/// the focal length; EX_CANTCREAT, also for a file that exists.
Done calibrate(const CalibrateOptions& options, Report& report);

/// Finds the board in one picture, before there are enough for a lens, and reports where its outer corners lie, and how
/// sharp it is. Errors: those of readPicture(); EX_DATAERR if the picture shows no such board.
Done findBoard(const std::string& picture, const Board& board, Report& report);

struct PictureOptions {
  std::string picture;  ///< file
  std::string gel;      ///< file
  std::string output;   ///< a gel file, or a PNG picture for mark()
};

struct PoseOptions : PictureOptions {
  /// A pose with a larger residual is refused; a good pattern has hundredths of a pixel. One above 0.5 that is accepted
  /// causes a warning.
  double acceptResidual_px = 0.5;
  /// The lens that the gel file has was measured on another camera, and is on the picture's now: its focal length and
  /// principal point are taken as less well known.
  bool sameLens = false;
  /// Writes a pose although the picture contradicts the gel file's layers, with a warning, and replaces a file.
  bool force = false;
};

/// Estimates the camera's pose from one picture of the untouched gel and writes a gel file with camera, lens and the
/// uncertainty of pose and focal length; that of principal point, k1 and k2 stays the file's. Errors: those of
/// loadGel() and readPicture(); EX_DATAERR if the picture is of another camera than the lens, or of another cut of its
/// picture, the markers are not found, are fewer than 12, no pose fits, the picture
/// shows other columns, rows or layers, or the residual is too large, as with another aspect, which it then states;
/// EX_CANTCREAT, also for a file that exists.
Done pose(const PoseOptions& options, Report& report);

/// Draws the markers of the untouched gel into the picture, at twice its size: circles where they were found, crosses
/// where they are missing. Writes a PNG picture. Errors: those of loadGel() and readPicture(); EX_DATAERR if the
/// markers are not found; EX_CANTCREAT.
Done mark(const PictureOptions& options, Report& report);

struct SheetsOptions {
  std::string gel;        ///< gel file; empty: the paper's sensor
  std::string directory;  ///< created if it does not exist; empty: the current one
  bool mirrored = false;  ///< as of sheet()
};

/// Writes the sheets to print: layer1.svg, layer2.svg ..., one after another. Errors: those of loadGel(); EX_CANTCREAT,
/// after which the sheets written before remain.
Done writeSheets(const SheetsOptions& options, Report& report);

/// Reads a gel file; an empty path gives the paper's sensor. Errors: EX_NOINPUT, EX_CONFIG; EX_DATAERR for a faulty
/// influence file.
tl::expected<sensor::Sensor, Faults> loadGel(const std::string& path);

/// Returns whether a gel file states a key of its camera; an empty path states nothing.
bool statesOfCamera(const std::string& gel, std::string_view key);

/// Writes a gel file without a calibration, which no longer applies, and reports its path and, if there was one, that a
/// calibration was left out. Error: EX_CANTCREAT.
/// \param remark one line on the origin of the values
Done writeGel(const std::string& path, sensor::Sensor sensor, const std::string& remark, Report& report);

/// Fails with EX_CANTCREAT if there is a file at `path`, unless it may be replaced.
Done checkOutput(const std::string& path, bool replace);

/// Returns an error of the input data: EX_DATAERR with the given fields of Error, of which `where` may be empty.
tractiond::Error fault(const std::string& where, std::string what, std::string remedy = "");

}  // namespace lens

// What a measurement was made with. A lens, a pose or a zero holds for one camera and one cut of its picture only: with
// another it gives wrong numbers that look right. Gel file, zero and pictures of tractionctl state it as one text.
#pragma once

#include <string>

namespace sensor {

struct MeasuredWith {
  std::string camera;   ///< "VENDOR-SERIAL"; empty: not known
  std::string picture;  ///< "640 x 480 px, ReverseX = true"; empty: not known

  /// \param text of text(), or the camera alone; empty: nothing is known
  static MeasuredWith parse(const std::string& text);
  /// Returns "VENDOR-SERIAL (640 x 480 px, ReverseX = true)"; empty if the camera is not known.
  std::string text() const;
  /// Returns whether this holds for another camera and picture, of which a part that is not known here or there holds.
  bool holdsFor(const MeasuredWith& other) const;
};

/// Returns the name of a camera, "VENDOR-SERIAL"; '_' replaces characters that TOML would have to escape.
std::string cameraId(const std::string& vendor, const std::string& serial);

}  // namespace sensor

// What is asked of a calibration, and what it tells.
#pragma once

#include <string>
#include <vector>

namespace tractiond {

struct CalibrationStep {
  enum class Kind {
    kGeometry,   ///< pose and distortion from the zero in force
    kNoise,      ///< of markers and picture while nothing touches
    kWeight,     ///< a known weight is put on, or stands there
    kStiffness,  ///< Young's modulus from the weights read so far
    kFinish,     ///< writes the gel file
  };
  Kind kind = Kind::kGeometry;
  double seconds = 0.0;   ///< noise: to look; weight: to wait for it to come to rest
  double weight_N = 0.0;  ///< weight
  bool first = false;     ///< weight: forget those before
  bool anyway = false;    ///< geometry, noise: also if something seems to touch
  std::string name;       ///< finish: the file's name begins with it
};

struct CalibrationReport {
  struct Figure {
    std::string name;  ///< "focal_px"
    double value = 0.0;
    double deviation = 0.0;  ///< standard, in the value's unit; 0: none is known
  };
  std::vector<Figure> figures;
  std::vector<std::string> remarks;  ///< for people
  std::string path;                  ///< of the file that was written
};

}  // namespace tractiond

// Requests and results of the steps of a calibration.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace tractiond {

struct CalibrationStep {
  enum class Kind {
    kGeometry,   ///< estimates the camera's pose and distortion from the zero in force
    kNoise,      ///< measures the noise of markers and picture while nothing touches
    kWeight,     ///< waits until a known weight lies on the gel at rest, and reads it
    kStiffness,  ///< estimates Young's modulus from the weights read so far
    kFinish,     ///< writes the gel file
    kCreep,      ///< waits for a load that stays, and measures how the gel creeps under it
    kRecovery,   ///< waits until that load has gone, and measures the creep again with how the gel recovers
  };
  Kind kind = Kind::kGeometry;
  /// kNoise: duration; kWeight: longest wait; kCreep: for which the load stays; 0: the usual one; at most
  /// 3600 s
  double seconds = 0.0;
  double weight_N = 0.0;  ///< kWeight: finite and above 0, else the step is refused
  /// kWeight: of the known force on the gel, gel frame, of any length; 0: z of a block, that of the force itself of a
  /// body
  std::array<double, 3> direction = {};
  bool first = false;     ///< kWeight: true discards the weights read before
  bool anyway = false;    ///< kGeometry, kNoise: true proceeds even if something seems to touch
  std::string name = {};  ///< kFinish: beginning of the file's name, before "-" and the date; empty: "gel"
};

struct CalibrationReport {
  struct Figure {
    std::string name;  ///< "focal_px"
    double value = 0.0;
    double deviation = 0.0;  ///< standard deviation, in the value's unit; 0: not known
  };
  std::vector<Figure> figures;
  std::vector<std::string> remarks;  ///< sentences for the operator
  std::string path;                  ///< gel file that was written; empty: none
  std::string gelFile;               ///< its text
};

}  // namespace tractiond

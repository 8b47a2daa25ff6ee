// Asks things of a running tractiond.
#pragma once

#include "traction/camera.h"
#include "traction/description.h"
#include "traction/error.h"
#include "traction/keys.h"
#include "traction/status.h"

#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace traction {

struct ControlOptions {
  std::string instance = "default";  ///< of tractiond, on this machine
  std::string endpoint;              ///< ZeroMQ's, "tcp://HOST:9884"; empty: found by the instance
  Keys keys = {};                    ///< for a gateway
  // For answers. Who goes before the answer is told at once.
  std::chrono::milliseconds timeout{3000};
  std::chrono::milliseconds zeroTimeout{15'000};  ///< at least; longer where the daemon's status says so
  std::chrono::milliseconds workTimeout{60'000};  ///< of the camera
  /// Of a calibration step, in addition to its `seconds`. It covers the daemon's own time to look, where `seconds` is 0,
  /// and the computation, which takes minutes on a small machine.
  std::chrono::milliseconds calibrationTimeout{600'000};
};

struct ZeroOptions {
  bool anyway = false;  ///< also if something seems to touch the gel
};

/// What came of zero() or undoZero().
struct ZeroResult {
  Zero zero;                          ///< the zero taken or restored
  std::uint32_t markersPresent = 0;   ///< found in the picture
  std::uint32_t markersExpected = 0;  ///< of the gel
  double noise_levels = 0.0;          ///< standard deviation of a pixel between the rest frames [levels of the format]
  std::string remark;                 ///< why it may be wrong; empty: no reason is known
};

/// One step of a calibration: docs/calibration.md.
struct CalibrationStep {
  enum class Kind {
    kGeometry,   ///< pose and distortion from the zero in force
    kNoise,      ///< of markers and picture while nothing touches
    kWeight,     ///< waits until a known weight has been put on and has come to rest
    kStiffness,  ///< Young's modulus from the weights read so far; refused if they contradict each other
    kFinish,     ///< writes the gel file
  };
  Kind kind = Kind::kGeometry;
  double seconds = 0.0;   ///< noise: to look; weight: to wait for it; 0: as long as the daemon thinks right
  double weight_N = 0.0;  ///< weight
  bool first = false;     ///< weight: forget those before
  bool anyway = false;    ///< geometry, noise: also if something seems to touch
  std::string name;       ///< finish: the file's name begins with it
};

/// A picture of the camera, and what was found in it.
struct Snapshot {
  enum class MarkerState : std::uint8_t {
    kSought,  ///< markers are not known yet: the place is where the gel file has it
    kFound,
    kLost,    ///< present in the zero, not found: the place is where its neighbours have it
    kAbsent,  ///< not seen when the zero was taken
  };
  struct Marker {
    std::array<float, 2> place_px{};  ///< right, down; of the camera's picture
    Colour colour = Colour::kUnknown;
    MarkerState state = MarkerState::kSought;
  };
  struct Spot {
    std::array<float, 2> place_px{};
    Colour colour = Colour::kUnknown;
  };
  std::uint32_t width = 0, height = 0;  ///< px
  std::uint32_t channels = 0;           ///< bytes a pixel; 3: red, green, blue; 1: grey
  std::uint32_t reduced = 1;            ///< pixels of the camera to one of this picture, in each direction
  std::vector<std::uint8_t> levels;     ///< row after row
  std::string pixelFormat;              ///< that the camera sent
  std::uint64_t frameNumber = 0;
  std::int64_t receivedReal_ns = 0;  ///< since 1970
  std::vector<Marker> markers;
  std::vector<Spot>
      spots;  ///< whatever looks about like a marker, when the markers were last sought in a whole picture
};

struct CalibrationReport {
  struct Figure {
    std::string name;  ///< with its unit: "focal_px"
    double value = 0.0;
    double deviation = 0.0;  ///< standard; 0: none is known
  };
  std::vector<Figure> figures;
  std::vector<std::string> remarks;  ///< for people
  std::string path;                  ///< of the gel file that was written, on the daemon's host
};

/// What can be passed on without being read.
enum class Question { kStatus, kDescription, kZero, kUndoZero };

/// Thread-safe: every request has a connection of its own.
class TRACTION_EXPORT Control {
 public:
  /// \throws Error kBadEndpoint
  explicit Control(const ControlOptions& options = {});

  // All of them \throw Error kNoAnswer, kVersion, kMalformed, kRefused, kBadKeys, kNotAllowed.
  Status status() const;            ///< the last one published
  Description description() const;  ///< the last one published
  /// Takes what the camera sees now as the unloaded gel, and waits for it.
  ZeroResult zero(const ZeroOptions& options = {}) const;
  /// Restores the previous zero; the one in force becomes the previous one.
  ZeroResult undoZero() const;
  /// The next picture.
  Snapshot snapshot() const;
  /// Carries a step out and waits for it.
  CalibrationReport calibrate(const CalibrationStep& step) const;
  /// Has a step carried out by the camera and waits for it.
  CameraReport camera(const CameraStep& step) const;

  /// For others: asks and waits as the functions above do; the answer as it came, Protobuf's bytes of a Reply. \throws
  /// Error kNoAnswer, kBadKeys, kNotAllowed
  std::string pass(Question question) const;

  /// Where it asks; for messages to people.
  const std::string& endpoint() const { return options_.endpoint; }

 private:
  std::chrono::milliseconds zeroTakes() const;

  ControlOptions options_;
};

}  // namespace traction

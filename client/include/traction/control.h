// Sends requests to a running tractiond.
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
  std::string instance = "default";  ///< name of a tractiond on this machine
  /// ZeroMQ endpoint of the requests, "tcp://HOST:9884" or "ipc:///PATH"; empty: found from `instance`.
  std::string endpoint;
  Keys keys = {};  ///< needed for a traction-gateway only
  /// Time to connect, for every request, and then to wait for status() and description(). All other times are for the
  /// answer alone. If the daemon goes away during a request, the request fails at once with kNoAnswer.
  std::chrono::milliseconds timeout{3000};
  /// For zero(), undoZero() and snapshot(). For the zeros it is the minimum: zero_within_s of the status + 2 s applies
  /// where that is longer.
  std::chrono::milliseconds zeroTimeout{15'000};
  std::chrono::milliseconds workTimeout{60'000};  ///< for camera()
  /// For calibrate(), in addition to CalibrationStep::seconds. It covers the daemon's default duration where `seconds`
  /// is 0, and the computation, which takes minutes on a small machine.
  std::chrono::milliseconds calibrationTimeout{600'000};
};

struct ZeroOptions {
  bool anyway = false;  ///< true: takes the zero even if something seems to touch the gel
};

/// Outcome of zero() or undoZero().
struct ZeroResult {
  Zero zero;                          ///< the zero taken or restored
  std::uint32_t markersPresent = 0;   ///< found in the picture
  std::uint32_t markersExpected = 0;  ///< number of markers of the gel
  double noise_levels = 0.0;  ///< standard deviation of a pixel over the rest frames [levels of the pixel format]
  std::string remark;         ///< why the zero may be wrong; empty: no reason is known
};

/// One step of a calibration; docs/calibration.md describes the procedure.
struct CalibrationStep {
  enum class Kind {
    kGeometry,   ///< estimates camera pose and distortion from the zero in force
    kNoise,      ///< measures the noise of markers and picture while nothing touches the gel
    kWeight,     ///< waits until a known weight lies on the gel at rest, and reads it
    kStiffness,  ///< estimates Young's modulus from the weights read so far; refused if they contradict each other
    kFinish,     ///< writes the gel file
    kCreep,      ///< waits for a load that stays, and measures how the gel creeps under it
    kRecovery,   ///< waits until that load has gone, and measures the creep again with how the gel recovers
  };
  Kind kind = Kind::kGeometry;
  /// [s] For kNoise: duration of the measurement. For kWeight: longest wait for the weight. For kCreep: how long the
  /// load stays; for kRecovery: the same, for the time of the answer alone. 0: the daemon's default. Refused unless it
  /// is from 0 to 3600.
  double seconds = 0.0;
  double weight_N = 0.0;  ///< for kWeight [N]
  /// For kWeight: of the known force on the gel, gel frame, of any length. Only the part of what presses along it is
  /// the weight. All 0: z for a block, all of the force for another body.
  std::array<double, 3> direction{};
  bool first = false;     ///< for kWeight: true discards the weights read before
  bool anyway = false;    ///< for kGeometry, kNoise: true proceeds even if something seems to touch the gel
  std::string name = {};  ///< for kFinish: beginning of the gel file's name, 1 to 24 of A-Z a-z 0-9 _ -; empty: gel
};

/// A picture of the camera and the markers found in it. Positions are pixels of the camera's full picture.
struct Snapshot {
  enum class MarkerState : std::uint8_t {
    kSought,  ///< markers are not labelled yet; the position is the expected one of the gel file
    kFound,
    kLost,    ///< present in the zero, not found now; the position is interpolated from its neighbours
    kAbsent,  ///< not seen when the zero was taken
  };
  struct Marker {
    std::array<float, 2> place_px{};  ///< (u, v)
    Colour colour = Colour::kUnknown;
    MarkerState state = MarkerState::kSought;
  };
  struct Spot {
    std::array<float, 2> place_px{};
    Colour colour = Colour::kUnknown;
  };
  std::uint32_t width = 0, height = 0;  ///< of this picture [px]
  std::uint32_t channels = 0;           ///< bytes per pixel; 3: red, green, blue; 1: grey
  /// Camera pixels per pixel of this picture, in each direction: it has the means of such blocks. Above 1 only where
  /// the picture would exceed 16 MiB.
  std::uint32_t reduced = 1;
  std::vector<std::uint8_t> levels;  ///< height x width x channels, row by row
  std::string pixelFormat;           ///< pixel format that the camera sent
  std::string measuredWith;          ///< camera and picture: "VENDOR-SERIAL (640 x 480 px, ReverseX = true)"
  std::uint64_t frameNumber = 0;     ///< Header::frameNumber of the frame
  /// When the frame came from the camera driver: CLOCK_REALTIME of the daemon's host [ns since 1970].
  std::int64_t receivedReal_ns = 0;
  std::vector<Marker> markers;  ///< empty without a gel file, as `spots` are
  std::vector<Spot> spots;      ///< marker candidates of the last marker search over a whole picture
};

/// Answer to a CalibrationStep.
struct CalibrationReport {
  struct Figure {
    std::string name;  ///< ends with its unit: "focal_px"
    double value = 0.0;
    double deviation = 0.0;  ///< standard deviation, in the unit of `value`; 0: not known
  };
  std::vector<Figure> figures;
  std::vector<std::string> remarks;  ///< for a person to read
  std::string path;                  ///< gel file that was written, on the daemon's host; empty: none
  std::string gelFile;               ///< its text
};

/// Requests that pass() sends; kZero is without ZeroOptions::anyway.
enum class Question { kStatus, kDescription, kZero, kUndoZero };

/// Client of a daemon's control endpoint. Thread-safe: each request opens a connection of its own. Every request blocks
/// until its answer, at most for the times of ControlOptions, and throws Error kBadEndpoint, kNoAnswer, kVersion,
/// kMalformed, kRefused (the daemon cannot or will not carry it out), kBadKeys or kNotAllowed. Handlers of signals do
/// not end the wait. After kNoAnswer the daemon may still carry out the request. Requests for a zero first ask for the
/// status, which may take its time as well.
class TRACTION_EXPORT Control {
 public:
  /// Finds the endpoint, once for all requests: `options.endpoint`, or the socket of `options.instance` if that is
  /// empty. Neither connects nor checks endpoint and keys: the requests do.
  /// \param options are copied
  /// \throws Error kBadEndpoint if the endpoint is empty and the instance's name is invalid, or another user may
  /// control the directory of its sockets
  explicit Control(const ControlOptions& options = {});

  Status status() const;            ///< Returns the status that the daemon published last.
  Description description() const;  ///< Returns the description that the daemon published last.
  /// Takes the gel as unloaded: the rest pose, a mean over frames after the request, becomes the zero in force. Takes
  /// seconds. Error kRefused also if something seems to touch the gel, unless ZeroOptions::anyway is true.
  ZeroResult zero(const ZeroOptions& options = {}) const;
  /// Restores the previous zero. The zero in force becomes the previous one, so that a second call undoes the first.
  /// Error kRefused if there is no previous zero.
  ZeroResult undoZero() const;
  /// Returns the next picture of the camera, with the markers found in it. Error kRefused if no picture comes.
  Snapshot snapshot() const;
  /// Carries out one step of a calibration, which may take minutes. Error kRefused also if a later step, perhaps of
  /// another client, replaces it, or if CalibrationStep::seconds is not finite.
  CalibrationReport calibrate(const CalibrationStep& step) const;
  /// Carries out one request to the camera, after those that came before. Error kRefused also if the camera refuses it.
  CameraReport camera(const CameraStep& step) const;

  /// Puts a gel file in force: the daemon keeps it in its state directory, and starts again with it after the answer;
  /// for a gel that is new to it, it answers again when it has computed its factors. Error kRefused also unless the
  /// daemon's sensor.gel_file is "adopted", and if the gel file is wrong or not of its camera.
  /// \param gelFile its text, at most 60 kB
  void adopt(const std::string& gelFile) const;

  /// Sends a request and returns its answer undecoded: the Protobuf bytes of a traction.v1.Reply, which may hold the
  /// daemon's error and is not checked. For gateways and exporters.
  /// \throws Error kBadEndpoint, kNoAnswer, kBadKeys, kNotAllowed
  std::string pass(Question question) const;

  /// Returns the endpoint that a request goes to now: of an instance, whose daemon may start later, it is looked up
  /// anew.
  /// \throws Error kBadEndpoint
  std::string endpoint() const;

 private:
  /// Returns how long to wait for a zero: as long as the daemon says that it takes, and 2 s, but zeroTimeout at least.
  std::chrono::milliseconds zeroTakes() const;
  ControlOptions located() const;

  ControlOptions options_;
};

}  // namespace traction

// Records <-> bytes of proto/traction/v1. With wire_camera the only files of the daemon that see Protobuf.
#pragma once

#include "daemon/publish/description.h"
#include "daemon/publish/status.h"
#include "daemon/records/calibration.h"
#include "daemon/records/camera_features.h"
#include "daemon/records/ledger.h"
#include "daemon/records/snapshot.h"
#include "daemon/records/traction_field.h"
#include "daemon/records/zero_request.h"

#include <tl/expected.hpp>

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace traction::v1 {
class Description;
}

namespace tractiond::publish {

/// What the header of a message says besides the identity.
struct Heading {
  std::uint64_t sequence = 0;
  FrameInfo frame;
  std::uint32_t flags = 0;
  Id zero{};
  std::int64_t sent_ns = 0;      ///< CLOCK_MONOTONIC
  std::int64_t sentReal_ns = 0;  ///< CLOCK_REALTIME
};

/// A description is encoded once and sent many times.
class DescriptionMessage {
 public:
  DescriptionMessage(const Description& description, const std::vector<std::string>& topics);
  ~DescriptionMessage();

  /// Fills the header anew; bytes of the message.
  std::size_t fill(const Heading& heading);
  /// What was filled last.
  void write(std::uint8_t* bytes) const;
  std::string bytes() const;

 private:
  std::unique_ptr<traction::v1::Description> message_;
};

/// Fills one message of each kind again and again in the same memory: after the first of a kind nothing is allocated.
/// Each returns the size in bytes and must be followed by its write.
class Wire {
 public:
  explicit Wire(const Identity& identity);
  ~Wire();

  std::size_t fill(const TractionField& field, const Heading& heading);
  std::size_t fill(const MarkerField& markers, const Heading& heading);
  std::size_t fill(const Ledger& ledger, const Status& status, const Heading& heading);
  void writeField(std::uint8_t* bytes) const;
  void writeMarkers(std::uint8_t* bytes) const;
  void writeStatus(std::uint8_t* bytes) const;

 private:
  struct Messages;
  std::unique_ptr<Messages> messages_;
};

// --- control

enum class Request { kStatus, kDescription, kZero, kCalibrate, kCamera, kSnapshot };

/// A request with what it says.
struct Asked {
  Request request = Request::kStatus;
  ZeroRequest zero = {};             ///< kZero, without its asker
  CalibrationStep calibration = {};  ///< kCalibrate
  CameraStep camera = {};            ///< kCamera
  std::string onBehalfOf = {};       ///< whom a gateway names as the asker, printable; empty: whoever sends it
};

/// From anybody: never trusted. The error is a sentence for the asker.
tl::expected<Asked, std::string> decodeRequest(std::string_view bytes);

/// `message` is a Status or Description as it was sent, answering `request`.
std::string encodeReply(Request request, std::string_view message);
/// `remark`: why it may be no zero; empty where nothing speaks against it.
std::string encodeZeroReply(const RestPose& zero, std::string_view remark);
std::string encodeCalibrationReply(const CalibrationReport& report);
std::string encodeCameraReply(const CameraReport& report);
/// Reduced until it has at most 16 MiB. \param sensor whose markers they are.
std::string encodeSnapshotReply(const Snapshot& snapshot, const sensor::Sensor& sensor);
std::string encodeErrorReply(std::string_view error);

}  // namespace tractiond::publish

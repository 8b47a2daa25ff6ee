// What a recording has besides the topics of the stream, as bytes: with it the same fields can be computed again.
#pragma once

#include "base/error.h"
#include "daemon/publish/description.h"
#include "daemon/records/frame_copy.h"
#include "daemon/records/tracker_inputs.h"

#include <tl/expected.hpp>

#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace traction::v1 {
class Picture;
}

namespace tractiond::publish {

/// All that fields rest on but the pictures.
struct Beginning {
  std::string sensor;
  std::string softwareVersion;  ///< of the daemon
  Id calibration{};             ///< hash of what the forces rest on
  std::string configuration;    ///< text of a file with every key
  std::string gel;              ///< text of the gel file; empty: the built-in one
  std::string influence;        ///< the influence file that it names; empty: none
  std::optional<RestPose> rest;
  std::string cameraVendor, cameraModel, cameraSerial;
  /// Of a recording of version 1: a zero that was asked for came into force as soon as it had been taken.
  bool adoptsAtOnce = false;
};

std::string encode(const Beginning& beginning);

/// EX_DATAERR: damaged; EX_PROTOCOL: of a newer version. The rest pose's numbers are not looked at, its sizes fit each
/// other.
tl::expected<Beginning, Error> decodeBeginning(std::string_view bytes);

/// A picture that was tracked, and what the tracker was told then.
struct TrackedFrame : FrameCopy {
  std::uint64_t number = 0;  ///< of those that were tracked, from 1
  TrackerInputs inputs;
};

/// Encodes in the same memory again and again.
class PictureMessage {
 public:
  explicit PictureMessage(const Identity& identity);
  ~PictureMessage();

  /// \param packed compressed, without a loss. Valid until the next.
  const std::string& encode(const TrackedFrame& frame, bool packed);

 private:
  std::unique_ptr<traction::v1::Picture> message_;
  std::string bytes_, scratch_;
};

/// EX_DATAERR: damaged, or it cannot be read here. The frame then has as many bytes as its format, size and stride ask
/// for; a rest pose's sizes fit each other.
tl::expected<void, Error> decodePicture(std::string_view bytes, TrackedFrame& frame);

}  // namespace tractiond::publish

// Encodes and decodes what a recording has besides the topics of the stream: with it the same fields can be computed
// again.
#pragma once

#include "base/error.h"
#include "daemon/publish/description.h"
#include "daemon/records/frame_copy.h"
#include "daemon/records/tracker_inputs.h"
#include "traction/v1/recording.pb.h"

#include <tl/expected.hpp>

#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace tractiond::publish {

/// Everything that fields are computed from, except the pictures: the message, and the zero in it as a record.
struct Beginning {
  traction::v1::Beginning message;  ///< `version` is set where it was decoded; `rest` has no meaning
  std::optional<RestPose> rest;

  /// Returns whether a requested zero came into force as soon as it had been taken.
  bool adoptsAtOnce() const { return message.version() < 2; }
  /// Returns whether TrackedFrame::places is known.
  bool statesPlaces() const { return message.version() >= 3; }
};

/// Returns the bytes of a beginning, of the newest version. Reentrant.
std::string encode(const Beginning& beginning);

/// Decodes untrusted bytes. EX_DATAERR: damaged; EX_PROTOCOL: of a newer version. Checks that the sizes within the rest
/// pose fit each other, but neither its numbers (track::isSane) nor the texts. Reentrant.
tl::expected<Beginning, Error> decodeBeginning(std::string_view bytes);

/// A picture that was tracked, and the tracker's inputs for it.
struct TrackedFrame : FrameCopy {
  std::uint64_t number = 0;  ///< counts the tracked frames from 1
  TrackerInputs inputs;
  Id places{};  ///< MarkerField::places
};

/// Encodes pictures in the same memory every time. Thread-bound.
class PictureMessage {
 public:
  /// \param identity part of every message; copied
  explicit PictureMessage(const Identity& identity);
  ~PictureMessage();

  /// Returns the bytes of a picture, valid until the next call. `frame` must fit (FrameCopy::fits).
  /// \param packed true: compresses the pixels without loss, unless zlib has no memory
  const std::string& encode(const TrackedFrame& frame, bool packed);

 private:
  std::unique_ptr<traction::v1::Picture> message_;
  std::string bytes_, scratch_;
};

/// Decodes untrusted bytes into `frame`. EX_DATAERR: damaged, with a side above 65,535 px or more than 512 MiB, or of a
/// pixel format that this program cannot read. On success the frame has the bytes that its format, size and stride
/// need, and the sizes within a rest pose fit each other. After an error `frame` has no meaning. `bytes` need not
/// outlive the call. Reentrant.
tl::expected<void, Error> decodePicture(std::string_view bytes, TrackedFrame& frame);

}  // namespace tractiond::publish

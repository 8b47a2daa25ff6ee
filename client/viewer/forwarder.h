// Passes messages to browsers, and computes from them what would take a page too long or too many bytes.
#pragma once

#include "client/viewer/frame.h"
#include "client/viewer/surface.h"

#include <atomic>
#include <optional>

namespace traction::view {

/// Thread-bound, except for want().
class Forwarder {
 public:
  /// \param deliver called by pass(), on its thread
  explicit Forwarder(Deliver deliver)
      : deliver_(std::move(deliver)) {}

  /// Delivers the message as published; then kPlaces of a description, kSurface of a field and kPicture of a preview.
  /// Delivers kPreview, kSurface and kPicture only once they are wanted, and the latter two only if they can be
  /// computed (Surface::displacement(), jpegOf()); all other kinds always. Calls `deliver` on this thread, before it
  /// returns.
  /// \param raw topic and bytes of `message`
  void pass(const Message& message, const Raw& raw);

  /// Adds kinds (or-ed) to those that are wanted; none can be taken back. Matters for kPreview, kSurface and kPicture
  /// only. The matrix for kSurface takes seconds, in which it is of a half space, and memory. Thread-safe.
  void want(unsigned kinds) { wanted_ |= kinds; }

 private:
  bool wants(unsigned kind) const { return (wanted_ & kind) != 0; }
  void passSurface(const Field& field);
  void passPlaces(const Description& description);
  void passPicture(const Preview& preview);

  Deliver deliver_;
  std::optional<Description> description_;  ///< the last one, which surface_ does not know yet
  Surface surface_;
  std::atomic<unsigned> wanted_{0};
};

}  // namespace traction::view

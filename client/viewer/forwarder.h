// Passes messages to browsers, and computes from them what a page would take too long for, or too many bytes.
#pragma once

#include "client/viewer/frame.h"
#include "client/viewer/jpeg.h"
#include "client/viewer/surface.h"

#include <atomic>
#include <optional>

namespace traction::view {

/// Thread-bound, except for wantSurface() and wantPicture().
class Forwarder {
 public:
  explicit Forwarder(Deliver deliver)
      : deliver_(std::move(deliver)) {}

  /// Delivers the message as published; then kPlaces of a description, kSurface of a field and kPicture of a preview,
  /// the last two once they are wanted.
  void pass(const Message& message, const Raw& raw);

  /// Delivers kSurface from now on. Its matrix takes seconds and memory. Thread-safe.
  void wantSurface() { wantsSurface_ = true; }
  /// Delivers kPicture from now on. Thread-safe.
  void wantPicture() { wantsPicture_ = true; }

 private:
  void passSurface(const Field& field);
  void passPlaces(const Description& description);
  void passPicture(const Preview& preview);

  Deliver deliver_;
  std::optional<Description> description_;  ///< the last one, which surface_ does not know yet
  Surface surface_;
  JpegEncoder jpeg_;
  std::atomic<bool> wantsSurface_{false}, wantsPicture_{false};
};

}  // namespace traction::view

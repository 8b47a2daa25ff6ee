// Messages for browsers, and what is computed of them there is no room for in a page.
#pragma once

#include "client/viewer/frame.h"
#include "client/viewer/surface.h"

#include <atomic>
#include <optional>

namespace traction::view {

/// Thread-bound, but for wantSurface().
class Forwarder {
 public:
  explicit Forwarder(Deliver deliver)
      : deliver_(std::move(deliver)) {}

  /// As it came; behind a description kPlaces, behind a field kSurface where somebody wants it.
  void pass(const Message& message, const Raw& raw);

  /// Its matrix takes seconds and memory, and not everybody looks at it. Thread-safe.
  void wantSurface() { wantsSurface_ = true; }

 private:
  void passSurface(const Field& field);
  void passPlaces(const Description& description);

  Deliver deliver_;
  std::optional<Description> description_;  ///< the last one, not yet told to surface_
  Surface surface_;
  std::atomic<bool> wantsSurface_{false};
};

}  // namespace traction::view

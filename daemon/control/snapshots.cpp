#include "daemon/control/snapshots.h"

#include <utility>

namespace tractiond::control {

Snapshots::Snapshots(Replies* replies, std::vector<sensor::MarkerLayer> layers, std::int64_t (*clock)())
    : replies_(replies)
    , layers_(std::move(layers))
    , clock_(clock) {}

void Snapshots::setCamera(std::size_t frame_bytes, std::string waits) {
  frame_bytes_ = frame_bytes;
  waits_ = std::move(waits);
}

const Snapshot* Snapshots::take() {
  Snapshot* const snapshot = lent_ ? loan_.own() : nullptr;
  if (!snapshot) return nullptr;
  lent_ = false;
  if (!snapshot->fits) {
    snapshot->makeRoom(snapshot->frame.size);
    return nullptr;
  }
  if (std::exchange(askedAt_ns_, 0) != 0) replies_->answerSnapshot(snapshot, layers_);
  return snapshot;
}

void Snapshots::turn(bool isWanted) {
  constexpr std::int64_t kLongestWait_ns = 3'000'000'000;
  if (!lent_ && (isWanted || askedAt_ns_ != 0)) {
    loan_.own()->makeRoom(frame_bytes_);
    lent_ = true;
    loan_.lend();
  }
  if (askedAt_ns_ != 0 && clock_() - askedAt_ns_ > kLongestWait_ns) {
    askedAt_ns_ = 0;
    replies_->answerSnapshot(tl::unexpected(noFrames(waits_)), layers_);
  }
}

}  // namespace tractiond::control

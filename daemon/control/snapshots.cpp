#include "daemon/control/snapshots.h"

#include <utility>

namespace tractiond::control {

Snapshots::Snapshots(Replies* replies, std::vector<sensor::MarkerLayer> layers, double longestWait_s,
                     std::int64_t (*clock)())
    : replies_(replies)
    , layers_(std::move(layers))
    , longestWait_ns_(static_cast<std::int64_t>(1e9 * longestWait_s))
    , clock_(clock) {}

void Snapshots::meet(std::size_t frame_bytes, std::string waits) {
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
  if (std::exchange(askedAt_ns_, 0) != 0) answer(snapshot);
  return snapshot;
}

void Snapshots::turn(bool isWanted) {
  if (!lent_ && (isWanted || askedAt_ns_ != 0)) {
    loan_.own()->makeRoom(frame_bytes_);
    lent_ = true;
    loan_.lend();
  }
  if (askedAt_ns_ != 0 && clock_() - askedAt_ns_ > longestWait_ns_) {
    askedAt_ns_ = 0;
    answer(tl::unexpected("no frames come from the camera" + (waits_.empty() ? "" : ": " + waits_)));
  }
}

void Snapshots::answer(const tl::expected<const Snapshot*, std::string>& result) {
  replies_->answerSnapshot(result, layers_);
}

}  // namespace tractiond::control

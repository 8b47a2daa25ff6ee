#include "daemon/app/previewer.h"

#include "base/clock.h"

#include <algorithm>
#include <utility>

namespace tractiond {

void Previewer::takeFrame(const Frame& frame, const MarkerField* markers) {
  Copy* const wanted = loan_.lent();
  if (!wanted) return;
  wanted->copyFrom(frame);
  wanted->flags = markers ? markers->flags : 0;
  wanted->zero = markers ? markers->zero : Id{};
  loan_.giveBack();
  taken_.signal();
}

void Previewer::turn(std::chrono::milliseconds timeout) {
  const bool wanted = publisher_.previewWanted();
  const std::int64_t now_ns = monotonicNow();
  if (Copy* const copy = loan_.own()) {
    if (std::exchange(lent_, false)) {
      if (!copy->fits) {
        copy->makeRoom(copy->frame.size);
      } else if (wanted) {
        offer(*copy, now_ns);
      }
    }
    if (wanted && now_ns >= due_ns_) {
      copy->makeRoom(frame_bytes_.load(std::memory_order_relaxed));
      lent_ = true;
      loan_.lend();
    }
  }
  if (wanted && !lent_) {
    timeout = std::min(timeout, std::chrono::ceil<std::chrono::milliseconds>(
                                    std::chrono::nanoseconds(std::max<std::int64_t>(due_ns_ - now_ns, 0))));
  }
  taken_.wait(timeout);
}

void Previewer::offer(const Copy& copy, std::int64_t now_ns) {
  const Frame& frame = copy.frame;
  preview_.factor = std::clamp((frame.width + options_.width_px - 1) / options_.width_px, 1,
                               std::max(1, std::min(frame.width, frame.height)));
  reduce(frame, preview_.factor, preview_.picture);
  preview_.info = frame.info;
  preview_.flags = copy.flags;
  preview_.zero = copy.zero;
  publisher_.offerPreview(preview_);
  // Keeps a fixed pace, unless pictures arrive more slowly or after a pause.
  const auto period_ns = static_cast<std::int64_t>(1e9 / options_.rate_Hz);
  due_ns_ += period_ns;
  if (due_ns_ <= now_ns) due_ns_ = now_ns + period_ns;
}

}  // namespace tractiond

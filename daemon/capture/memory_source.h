// Pictures in memory as a camera: for benchmarks, replay and tests.
#pragma once

#include "daemon/base/clock.h"
#include "daemon/capture/frame_source.h"
#include "daemon/records/ledger.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace tractiond::capture {

struct Pictures {
  int width = 0, height = 0;  ///< px
  PixelFormat format = PixelFormat::kRgb8;
  std::vector<std::vector<std::uint8_t>> data;  ///< each without padding
};

void sleepUntilMonotonic(std::int64_t until_ns);

/// Thread-bound. Hands out the pictures themselves, so any number may be out.
class MemorySource : public FrameSource {
 public:
  struct Options {
    std::uint64_t loops = 1;     ///< 0: for ever
    std::int64_t period_ns = 0;  ///< 0: as fast as they are asked for; it then never times out
    Ledger* ledger = nullptr;    ///< counts what is handed out as received
    std::function<std::int64_t()> now = monotonicNow;
    std::function<void(std::int64_t until_ns)> sleepUntil = sleepUntilMonotonic;
  };

  MemorySource(const Pictures& pictures, const Options& options);  ///< the pictures must outlive it

  Next next(Frame& frame, std::chrono::milliseconds timeout) override;
  void recycle(Frame& frame) override;

 private:
  const Pictures& pictures_;
  Options options_;
  std::uint64_t count_ = 0;  ///< handed out
  std::int64_t start_ns_ = 0;
};

}  // namespace tractiond::capture

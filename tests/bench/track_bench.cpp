// What tracking one frame costs: 1152 markers, 640 x 480, one thread. 64 different pictures in turn, so that neither
// the pictures nor the branches are learnt by heart.
#include "tests/unit/track/scene.h"

#include <benchmark/benchmark.h>

namespace tractiond::track {
namespace {

enum class Motion { kStill, kPress, kStandingStart };

/// Pictures that follow each other, back and forth.
struct Film {
  Film(twin::Format format, Motion motion)
      : scene({}, format) {
    constexpr int kFrames = 64;
    for (int i = 0; i < kFrames; ++i) {
      Bump bump;
      const double there = i < kFrames / 2 ? i : kFrames - 1 - i;
      if (motion == Motion::kPress) bump.peak_px = {0.1 * there, 0.05 * there};
      if (motion == Motion::kStandingStart) bump.peak_px = {i / 4 % 2 ? 7.0 : 0.0, 0.0};
      scene.displace(bump, 0.9);
      frames.push_back(scene.shoot());
      pictures.emplace_back(frames.back().data, frames.back().data + frames.back().size);
      frames.back().data = pictures.back().data();
    }
  }

  Scene scene;
  std::vector<Frame> frames;
  std::vector<std::vector<std::uint8_t>> pictures;
};

void track(benchmark::State& state, twin::Format format, Motion motion, bool gaps) {
  Film film(format, motion);
  Scene still({}, format);
  Tracking tracking(still);
  tracking.start(still);
  std::size_t next = 0;
  for (auto _ : state) {
    Frame& frame = film.frames[next++ % film.frames.size()];
    frame.info.discontinuity = gaps;
    tracking(frame);
  }
  state.counters["valid"] = tracking.field.validCount;
}

BENCHMARK_CAPTURE(track, rgb8Still, twin::Format::kRgb8, Motion::kStill, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(track, rgb8Press, twin::Format::kRgb8, Motion::kPress, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(track, rgb8SevenPixelStarts, twin::Format::kRgb8, Motion::kStandingStart, false)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(track, bayerPress, twin::Format::kBayerRG8, Motion::kPress, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(track, relabelled, twin::Format::kRgb8, Motion::kPress, true)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace tractiond::track

BENCHMARK_MAIN();

// What tracking one frame costs: 1152 markers, 640 x 480, one thread. 64 different pictures in turn, so that neither
// the pictures nor the branches are learnt by heart.
#include "tests/unit/track/scene.h"

#include <benchmark/benchmark.h>

namespace tractiond::track {
namespace {

enum class Motion { kStill, kPress, kStandingStart };

/// Dark markers want a light gel.
twin::Optics opticsOf(const sensor::Sensor& sensor) {
  twin::Optics optics;
  if (sensor.layers[1].darker) optics.background = 125.0;
  return optics;
}

/// Pictures that follow each other, back and forth.
struct Film {
  Film(twin::Format format, Motion motion, const sensor::Sensor& sensor)
      : scene(opticsOf(sensor), format, sensor) {
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

void track(benchmark::State& state, twin::Format format, Motion motion) {
  sensor::Sensor sensor;
  // A camera without colours sees both layers if one of them is dark.
  sensor.layers[1].darker = traitsOf(format).colours == tractiond::PixelColours::kMono;
  Film film(format, motion, sensor);
  Scene still(opticsOf(sensor), format, sensor);
  Tracking tracking(still);
  tracking.start(still);
  std::size_t next = 0;
  for (auto _ : state) {
    tracking(film.frames[next++ % film.frames.size()]);
  }
}

BENCHMARK_CAPTURE(track, rgb8Still, twin::Format::kRgb8, Motion::kStill)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(track, rgb8Press, twin::Format::kRgb8, Motion::kPress)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(track, rgb8SevenPixelStarts, twin::Format::kRgb8, Motion::kStandingStart)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(track, bayerPress, twin::Format::kBayerRG8, Motion::kPress)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(track, mono8Press, twin::Format::kMono8, Motion::kPress)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(track, mono12Press, twin::Format::kMono12, Motion::kPress)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(track, mono12pPress, twin::Format::kMono12p, Motion::kPress)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(track, mono10PackedPress, twin::Format::kMono10Packed, Motion::kPress)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(track, bayerRG12Press, twin::Format::kBayerRG12, Motion::kPress)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(track, rgb12Press, twin::Format::kRgb12, Motion::kPress)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace tractiond::track

BENCHMARK_MAIN();

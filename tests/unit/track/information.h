// What a picture tells of its markers' places.
#pragma once

#include "tests/unit/track/scene.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace tractiond::track {

/// 1 / information about each marker's place, mean of both coordinates [px^2].
inline std::vector<double> boundsOf(Scene& scene, const twin::Optics& optics, double brightness) {
  constexpr double kStep_px = 0.2;
  constexpr int kReach_px = 9;
  const Eigen::Matrix2Xd places = scene.now;
  const int width = scene.sensor.camera.width, height = scene.sensor.camera.height;
  std::vector<double> bounds(static_cast<std::size_t>(scene.markers()), 0.0);
  int first = 0;
  for (const auto& layer : scene.sensor.layers) {
    for (int axis = 0; axis < 2; ++axis) {
      const auto shot = [&](double step) {
        scene.now = places;
        scene.now.block(axis, first, 1, layer.count()).array() += step;
        scene.shoot(false, brightness);
        return std::vector<std::int16_t>(scene.light().begin(), scene.light().end());
      };
      const auto before = shot(-kStep_px), after = shot(kStep_px);
      const auto perPixel = static_cast<int>(before.size()) / (width * height);
      for (int i = first; i < first + layer.count(); ++i) {
        const int u = static_cast<int>(std::lround(places(0, i))), v = static_cast<int>(std::lround(places(1, i)));
        double information = 0.0;
        for (int y = std::max(v - kReach_px, 0); y <= std::min(v + kReach_px, height - 1); ++y) {
          const int from = (y * width + std::max(u - kReach_px, 0)) * perPixel;
          const int to = (y * width + std::min(u + kReach_px, width - 1) + 1) * perPixel;
          for (int k = from; k < to; ++k) {
            const double a = std::min(before[k] / double{twin::Renderer::kUnits}, 255.0);
            const double b = std::min(after[k] / double{twin::Renderer::kUnits}, 255.0);
            const double slope = (b - a) / (2.0 * kStep_px);
            information += slope * slope / (optics.readNoise * optics.readNoise + optics.shotNoise * 0.5 * (a + b));
          }
        }
        bounds[i] += 0.5 / information;
      }
    }
    first += layer.count();
  }
  scene.now = places;
  return bounds;
}

}  // namespace tractiond::track

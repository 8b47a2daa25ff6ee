// Draws strokes as people do: each writer has own shapes, slant and aspect, each stroke its own size, speed, tremor and
// ends.
#pragma once

#include "client/input/strokes/recogniser.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <utility>

namespace traction::test {

/// A person. The same symbol is drawn with the same shape each time, but for what differs from stroke to stroke.
class Writer {
 public:
  /// \param strangeness how far the own shapes are from those that are shown, of a stroke's size; 0: they are these
  Writer(std::mt19937_64& generator, double strangeness)
      : generator_(generator)
      , strangeness_(strangeness)
      , slant_(strangeness > 0.0 ? normal(0.12) : 0.0)
      , aspect_(strangeness > 0.0 ? std::exp(normal(0.12)) : 1.0) {}

  /// Returns places of the finger [mm], 60 a second.
  /// \param shown of the symbol, any size
  input::Stroke draw(const std::string& symbol, const input::Stroke& shown) {
    input::Stroke shape = even(shown);
    auto& own = shapes_[symbol];
    if (own.empty()) own = waves(strangeness_);
    bend(shape, own);
    bend(shape, waves(0.025));
    const double slant = slant_ + normal(0.08), turn = normal(0.06), size_mm = uniform(6.0, 25.0);
    const double wide = aspect_ * std::exp(normal(0.08));
    for (auto& [x, y] : shape) {
      x = wide * (x + slant * y);
      const double u = size_mm * (std::cos(turn) * x - std::sin(turn) * y);
      y = size_mm * (std::sin(turn) * x + std::cos(turn) * y);
      x = u;
    }
    trimEnds(shape);
    return passed(shape);
  }

 private:
  static constexpr int kEven = 100;
  static constexpr int kWaves = 3;
  using Waves = std::array<std::array<double, 2>, 2 * kWaves>;  ///< along the stroke: cosine and sine, x and y

  double normal(double deviation) { return std::normal_distribution<double>(0.0, deviation)(generator_); }
  double uniform(double least, double most) { return std::uniform_real_distribution<double>(least, most)(generator_); }

  /// Returns points of equal distance, of a size of 1, with corners as round as a finger draws them.
  static input::Stroke even(const input::Stroke& shown) {
    std::vector<double> until = {0.0};
    for (std::size_t i = 1; i < shown.size(); ++i)
      until.push_back(until.back() + std::hypot(shown[i][0] - shown[i - 1][0], shown[i][1] - shown[i - 1][1]));
    const auto [left, right] = std::ranges::minmax(shown, {}, [](const auto& at) { return at[0]; });
    const auto [low, high] = std::ranges::minmax(shown, {}, [](const auto& at) { return at[1]; });
    const double scale = 1.0 / std::max(right[0] - left[0], high[1] - low[1]);
    input::Stroke points;
    for (int i = 0; i < kEven; ++i) {
      const double wanted = until.back() * i / (kEven - 1);
      const auto end =
          std::clamp<std::ptrdiff_t>(std::ranges::lower_bound(until, wanted) - until.begin(), 1, std::ssize(until) - 1);
      const auto k = static_cast<std::size_t>(end);
      const double part = (wanted - until[k - 1]) / std::max(until[k] - until[k - 1], 1e-12);
      points.push_back({scale * std::lerp(shown[k - 1][0], shown[k][0], part),
                        scale * std::lerp(shown[k - 1][1], shown[k][1], part)});
    }
    for (int pass = 0; pass < 4; ++pass) {
      const input::Stroke before = points;
      for (std::size_t i = 1; i + 1 < points.size(); ++i)
        for (const std::size_t k : {0U, 1U})
          points[i][k] = 0.25 * (before[i - 1][k] + 2.0 * before[i][k] + before[i + 1][k]);
    }
    return points;
  }

  Waves waves(double deviation) {
    Waves result{};
    for (std::size_t i = 0; i < result.size(); ++i)
      for (double& each : result[i]) each = normal(deviation / static_cast<double>(1 + i / 2));
    result[0][0] += 1e-12;  // drawn, also where it changes nothing
    return result;
  }
  static void bend(input::Stroke& shape, const Waves& by) {
    for (std::size_t i = 0; i < shape.size(); ++i) {
      for (std::size_t wave = 0; wave < by.size(); ++wave) {
        const double phase =
            std::numbers::pi * static_cast<double>((1 + wave / 2) * i) / static_cast<double>(shape.size() - 1);
        const double height = wave % 2 == 0 ? std::cos(phase) : std::sin(phase);
        for (const std::size_t k : {0U, 1U}) shape[i][k] += height * by[wave][k];
      }
    }
  }

  /// Begins and ends it a little too early or too late.
  void trimEnds(input::Stroke& shape) {
    for (int end = 0; end < 2; ++end) {
      std::ranges::reverse(shape);
      const int change = static_cast<int>(std::round(normal(2.0)));
      if (change < 0) shape.resize(shape.size() - static_cast<std::size_t>(std::min(-change, 5)));
      const std::array<double, 2> last = shape.back(), before = shape[shape.size() - 2];
      for (int i = 1; i <= std::min(change, 5); ++i)
        shape.push_back({last[0] + i * (last[0] - before[0]), last[1] + i * (last[1] - before[1])});
    }
  }

  /// Returns where the finger is in each frame: it is slower where it begins and ends, and trembles.
  input::Stroke passed(const input::Stroke& shape) {
    double length_mm = 0.0;
    for (std::size_t i = 1; i < shape.size(); ++i)
      length_mm += std::hypot(shape[i][0] - shape[i - 1][0], shape[i][1] - shape[i - 1][1]);
    const int frames = std::max(6, static_cast<int>(60.0 * length_mm / uniform(30.0, 120.0)));
    const double tremor_mm = std::abs(normal(0.25)), tremor_hz = uniform(8.0, 12.0), phase = uniform(0.0, 6.3);
    const double bias = uniform(-0.8, 0.8), direction = uniform(0.0, 6.3);
    input::Stroke places;
    for (int frame = 0; frame < frames; ++frame) {
      const double time = static_cast<double>(frame) / (frames - 1);
      const double way = time - bias * std::sin(2.0 * std::numbers::pi * time) / (2.0 * std::numbers::pi);
      const double at = way * static_cast<double>(shape.size() - 1);
      const std::size_t i = std::min(static_cast<std::size_t>(at), shape.size() - 2);
      const double tremble = tremor_mm * std::sin(2.0 * std::numbers::pi * tremor_hz * frame / 60.0 + phase);
      places.push_back({std::lerp(shape[i][0], shape[i + 1][0], at - static_cast<double>(i)) +
                            tremble * std::cos(direction) + normal(0.05),
                        std::lerp(shape[i][1], shape[i + 1][1], at - static_cast<double>(i)) +
                            tremble * std::sin(direction) + normal(0.05)});
    }
    return places;
  }

  std::mt19937_64& generator_;
  double strangeness_, slant_, aspect_;
  std::map<std::string, Waves> shapes_;
};

}  // namespace traction::test

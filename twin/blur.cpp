// In one dimension, the kernel k(t) is the Gaussian averaged over a pixel, k = Phi((t + 1/2) / s) - Phi((t - 1/2) / s),
// and K its integral. A strip of height dy from x0 to x1 then adds dy k(v - y) (K(x1 - u) - K(x0 - u)) to the pixel at
// (u, v): exact along x, a quadrature along y. k and K are tables with linear interpolation.
#include "twin/blur.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

namespace twin {

namespace {

constexpr double kTail = 4.0;                            // standard deviations; 6e-5 of the light lies beyond
constexpr double kStepsPerPixel = 512.0;                 // the error of linear interpolation is 1e-6
constexpr int kLeastStrips = 64, kMostStrips = 400'000;  // of an ellipse
constexpr double kStripsPerPixel = 4.0;                  // of half its height
constexpr int kColumns = 64;                             // of a picture that are drawn together

double normal(double t) {
  return 0.5 * std::erfc(-t * std::numbers::sqrt2 / 2.0);
}

/// Returns the integral of normal(t / sigma).
double ramp(double t, double sigma) {
  if (sigma <= 0.0) return std::max(t, 0.0);
  const double z = t / sigma;
  return t * normal(z) + sigma * std::exp(-0.5 * z * z) / std::sqrt(2.0 * std::numbers::pi);
}

double step(double t, double sigma) {
  return sigma > 0.0 ? normal(t / sigma) : (t < 0.0 ? 0.0 : t > 0.0 ? 1.0 : 0.5);
}

}  // namespace

std::vector<Strip> ellipseStrips(double a, double b, double angle) {
  // With y = height sin(t), the midpoint rule in t is exact for the area and converges fast for smooth kernels.
  const double height = std::hypot(a * std::sin(angle), b * std::cos(angle));
  const double lean = (a * a - b * b) * std::sin(angle) * std::cos(angle) / (height * height);
  std::vector<Strip> strips;
  const int count =
      static_cast<int>(std::clamp<double>(std::ceil(kStripsPerPixel * height), kLeastStrips, kMostStrips));
  strips.reserve(static_cast<std::size_t>(count));
  const double step = std::numbers::pi / count;
  for (int i = 0; i < count; ++i) {
    const double t = (i + 0.5) * step - 0.5 * std::numbers::pi;
    const double y = height * std::sin(t), halfWidth = a * b / height * std::cos(t);
    strips.push_back({y, height * std::cos(t) * step, lean * y - halfWidth, lean * y + halfWidth});
  }
  return strips;
}

Blur::Blur(double sigma_px)
    : reach_(kTail * sigma_px + 0.5) {
  const int half = static_cast<int>(std::ceil(reach_ * kStepsPerPixel));
  for (int i = -half; i <= half + 1; ++i) {
    const double t = i / kStepsPerPixel;
    kernel_.push_back(step(t + 0.5, sigma_px) - step(t - 0.5, sigma_px));
    integral_.push_back(ramp(t + 0.5, sigma_px) - ramp(t - 0.5, sigma_px));
  }
}

double Blur::at(const std::vector<double>& table, double offset) const {
  const double last = static_cast<double>(table.size() - 2);
  const double place = std::clamp(offset * kStepsPerPixel + 0.5 * last, 0.0, last);
  const auto index = static_cast<std::size_t>(place);
  const double fraction = place - static_cast<double>(index);
  return table[index] + fraction * (table[index + 1] - table[index]);
}

void Blur::add(std::span<const Strip> region, double left, double top, int size, double gain,
               std::span<float> pixels) const {
  assert(pixels.size() >= static_cast<std::size_t>(size) * static_cast<std::size_t>(size));
  std::array<double, kColumns> across{};
  for (const Strip& strip : region) {
    const int first = static_cast<int>(std::clamp<double>(std::ceil(strip.y - reach_ - top), 0.0, size));
    const int last = static_cast<int>(std::clamp<double>(std::floor(strip.y + reach_ - top), -1.0, size - 1.0));
    for (int column = 0; first <= last && column < size; column += kColumns) {
      const int count = std::min(kColumns, size - column);
      for (int i = 0; i < count; ++i) {
        const double u = left + (column + i);
        across[static_cast<std::size_t>(i)] = at(integral_, strip.x1 - u) - at(integral_, strip.x0 - u);
      }
      for (int j = first; j <= last; ++j) {
        const double weight = gain * strip.dy * at(kernel_, top + j - strip.y);
        float* const row = pixels.data() + static_cast<std::ptrdiff_t>(j) * size + column;
        for (int i = 0; i < count; ++i) row[i] += static_cast<float>(weight * across[static_cast<std::size_t>(i)]);
      }
    }
  }
}

}  // namespace twin

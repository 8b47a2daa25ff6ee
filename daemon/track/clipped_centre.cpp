// Sums up the normal equations over the samples that are there; their Cholesky factor is the triangle that the whole
// window's tables are made from, so that everything after it is as in centre.cpp.
#include "daemon/track/clipped_centre.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

namespace tractiond::track {

namespace {

constexpr int kMaxSteps = 10;
constexpr int kFunctions = 1 + MarkerTemplate::kRows;
constexpr float kSettled = 0.03F;  // of the radius; then the neglected cubic term is below 0.001 samples
constexpr float kLongest = 0.75F;  // of the radius: a step

using Triangle = MarkerTemplate::Triangle;
using Products = Eigen::Matrix<double, kFunctions, 1>;

/// The part of a window that is in the picture [samples]; right and bottom are the first beyond.
struct Part {
  int left, right, top, bottom;

  int count() const { return (right - left) * (bottom - top); }
};

/// Reads samples in levels, with or without the other colour's share.
class Reader {
 public:
  Reader(const Plane& plane, const CrossTalk& crossTalk, bool mixed)
      : plane_(plane)
      , share_(mixed ? crossTalk.other : 0.0F)
      , gain_(mixed ? 1.0F / (1.0F - crossTalk.own * crossTalk.other) : 1.0F)
      , mixed_(mixed) {}

  double operator()(int x, int y) const {
    const float own = plane_.at(x, y);
    if (!mixed_) return own;
    float other = 0.0F;
    for (const std::ptrdiff_t offset : plane_.other) other += 0.25F * besides(x, y, offset);
    return gain_ * (own - share_ * other);
  }

  /// Variance of what is read, of a plain sample's.
  float noise() const { return gain_ * gain_ * (1.0F + plane_.otherNoise * share_ * share_); }

 private:
  /// The value `offset` values after sample (x, y), whatever its colour [levels].
  float besides(int x, int y, std::ptrdiff_t offset) const {
    const std::ptrdiff_t index = std::ptrdiff_t{x} * plane_.step + offset;
    const std::uint8_t* row = plane_.first + y * plane_.stride;
    return plane_.wide ? plane_.gain * static_cast<float>(reinterpret_cast<const std::uint16_t*>(row)[index])
                       : static_cast<float>(row[index]);
  }

  const Plane& plane_;
  float share_, gain_;
  bool mixed_;
};

/// What the whole window's tables and sums say, of the part that is in the picture.
struct Sums {
  MarkerTemplate::Phase phase;
  Products p;  ///< with the orthonormal functions; the first is the constant
  double square = 0.0;  ///< sum of squares of levels less one of them
  float mean = 0.0F;    ///< [levels]
  int count = 0;      ///< 0: what is left does not tell the functions apart

  float at(int i) const { return static_cast<float>(p(i + 1)); }
};

/// \param rim samples along the border that are not read
Sums sumsAt(const Plane& plane, const MarkerTemplate& marker, const Reader& read, int rim, float x, float y) {
  const int left = static_cast<int>(x) - marker.half() + 1, top = static_cast<int>(y) - marker.half() + 1;
  const Part part{std::max(left, rim), std::min(left + 2 * marker.half(), plane.width - rim), std::max(top, rim),
                  std::min(top + 2 * marker.half(), plane.height - rim)};
  Sums sums;
  // Squares of whole levels would swamp what is left of them.
  const double base = read(part.left, part.top);
  Triangle products = Triangle::Zero();
  Products withLevels = Products::Zero();
  for (int row = part.top; row < part.bottom; ++row) {
    for (int column = part.left; column < part.right; ++column) {
      const MarkerTemplate::Functions functions = marker.functionsAt(column - double{x}, row - double{y});
      const double level = read(column, row) - base;
      products += functions.transpose() * functions;
      withLevels += level * functions.transpose();
      sums.square += level * level;
    }
  }
  const Eigen::LLT<Triangle> factor(products);
  if (factor.info() != Eigen::Success) return sums;
  sums.count = part.count();
  sums.phase = MarkerTemplate::phaseOf(factor.matrixU());
  sums.phase.cover = static_cast<float>(products(0, 1) / sums.count);
  sums.p = factor.matrixL().solve(withLevels);
  sums.mean = static_cast<float>(base + withLevels(0) / sums.count);
  return sums;
}

}  // namespace

void fitClippedCentre(const Plane& plane, const MarkerTemplate& marker, const CrossTalk& crossTalk, const Guess& guess,
                      Centre& centre) {
  // On a mosaic the other colour's samples are around this one's: those of the outermost are not all in the picture.
  const int rim = guess.mixed && plane.step == 2 ? 1 : 0;
  const float low = static_cast<float>(rim) + clippedMargin(marker);
  const float highX = static_cast<float>(plane.width - 1) - low, highY = static_cast<float>(plane.height - 1) - low;
  const auto radius = static_cast<float>(marker.radius());
  const Reader read(plane, crossTalk, guess.mixed);

  float x = (centre.u - plane.u0) / plane.scale, y = (centre.v - plane.v0) / plane.scale;
  const float slopeU = plane.scale * guess.slopeU, slopeV = plane.scale * guess.slopeV;  // per sample
  for (int steps = 0; steps < kMaxSteps; ++steps) {
    if (!(x >= low && x <= highX && y >= low && y <= highY)) break;
    const Sums sums = sumsAt(plane, marker, read, rim, x, y);
    if (sums.count == 0) break;
    const MarkerTemplate::Phase& phase = sums.phase;
    const auto seen = [&](int i) { return plane.sign * sums.at(i); };
    const auto& solve = phase.solve;
    const auto& lean = phase.lean;
    const float amplitude =
        solve[0] * seen(0) + solve[1] * seen(1) + solve[2] * seen(2) - lean[0] * slopeU - lean[1] * slopeV;
    centre.amplitude = amplitude;
    if (!(amplitude >= guess.minAmplitude)) break;
    float du = (solve[3] * seen(1) + solve[4] * seen(2) - lean[2] * slopeU - lean[3] * slopeV) / amplitude;
    float dv = (solve[5] * seen(2) - lean[4] * slopeU - lean[5] * slopeV) / amplitude;
    const float size = std::max(std::abs(du), std::abs(dv));
    if (size > kLongest * radius) {
      du *= kLongest * radius / size;
      dv *= kLongest * radius / size;
    }
    x += du;
    y += dv;
    if (size > kSettled * radius) continue;

    const auto count = static_cast<float>(sums.count);
    const auto rest = static_cast<float>(std::max(sums.square - sums.p.squaredNorm(), 0.0));
    const float noise = plane.noise * read.noise();
    const float perVariance = noise * plane.scale * plane.scale / (amplitude * amplitude);
    centre.misfit = rest / ((count - static_cast<float>(kFunctions)) * noise);
    centre.variance = phase.variance * perVariance;
    centre.blurred = seen(3);
    centre.slopeShare = phase.slopeShare * perVariance;
    centre.slopeU = (phase.solveSlope[0] * seen(4) + phase.solveSlope[1] * seen(5)) / plane.scale;
    centre.slopeV = phase.solveSlope[2] * seen(5) / plane.scale;
    centre.slopeVariance = phase.slopeVariance * noise / (plane.scale * plane.scale);
    centre.level = sums.mean + (0.5F - phase.cover) * plane.sign * amplitude;
    centre.found = x >= low && x <= highX && y >= low && y <= highY;
    break;
  }
  centre.u = plane.u0 + plane.scale * x;
  centre.v = plane.v0 + plane.scale * y;
}

float clippedAmplitudeAt(const Plane& plane, const MarkerTemplate& marker, float u, float v) {
  const float x = (u - plane.u0) / plane.scale, y = (v - plane.v0) / plane.scale, low = clippedMargin(marker);
  const float highX = static_cast<float>(plane.width - 1) - low, highY = static_cast<float>(plane.height - 1) - low;
  if (!(x >= low && x <= highX && y >= low && y <= highY)) return 0.0F;
  const Sums sums = sumsAt(plane, marker, Reader(plane, {}, false), 0, x, y);
  if (sums.count == 0) return 0.0F;
  const auto& solve = sums.phase.solve;
  return plane.sign * (solve[0] * sums.at(0) + solve[1] * sums.at(1) + solve[2] * sums.at(2));
}

}  // namespace tractiond::track

// Sums up the normal equations over the samples that lie in the picture. Their Cholesky factor is the triangle from
// which the tables of a whole window are made, so that all further steps are those of centre.cpp.
#include "daemon/track/direct_fit.h"

#include "daemon/track/template_step.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

namespace tractiond::track {

namespace {

constexpr int kMaxSteps = 10;
constexpr int kFunctions = 1 + MarkerTemplate::kRows;
constexpr float kSettled = 0.03F;  // share of the radius: the neglected cubic term is then below 0.001 samples
constexpr float kLongest = 0.75F;  // longest step, share of the radius
constexpr float kSettledExactly =
    0.01F;  // [samples]: steps are too short or too long if the template differs from the disc

template <int kCount>
using Square = Eigen::Matrix<double, kCount, kCount>;
template <int kCount>
using Column = Eigen::Matrix<double, kCount, 1>;

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
    for (const std::ptrdiff_t offset : plane_.other) other += 0.25F * plane_.at(x, y, offset);
    return gain_ * (own - share_ * other);
  }

  /// Returns the variance of a value that was read, relative to that of a plain sample.
  float noise() const { return gain_ * gain_ * (1.0F + plane_.otherNoise * share_ * share_); }

 private:
  const Plane& plane_;
  float share_, gain_;
  bool mixed_;
};

/// Products of functions with each other and with the levels of a window.
template <int kCount>
struct Products {
  Square<kCount> functions = Square<kCount>::Zero();
  Column<kCount> levels = Column<kCount>::Zero();
  double square = 0.0;  ///< sum of the squared levels
  double base = 0.0;    ///< subtracted from the levels before squaring, to keep precision
  int count = 0;        ///< number of samples
};

/// \param rim samples along the border that are not read
template <int kCount, typename Functions>
Products<kCount> productsAt(const Plane& plane, const MarkerTemplate& marker, const Reader& read, int rim, float x,
                            float y, const Functions& functionsAt) {
  const int left = static_cast<int>(x) - marker.half() + 1, top = static_cast<int>(y) - marker.half() + 1;
  const int right = std::min(left + 2 * marker.half(), plane.width - rim),
            bottom = std::min(top + 2 * marker.half(), plane.height - rim);
  const int firstColumn = std::max(left, rim), firstRow = std::max(top, rim);
  Products<kCount> products;
  products.count = (right - firstColumn) * (bottom - firstRow);
  products.base = read(firstColumn, firstRow);
  for (int row = firstRow; row < bottom; ++row) {
    for (int column = firstColumn; column < right; ++column) {
      const Column<kCount> functions = functionsAt(column - double{x}, row - double{y}).transpose();
      const double level = read(column, row) - products.base;
      products.functions += functions * functions.transpose();
      products.levels += level * functions;
      products.square += level * level;
    }
  }
  return products;
}

/// Returns the mean square of the levels' residual after the fit of the functions.
template <int kCount>
float leftOver(const Products<kCount>& products, const Column<kCount>& explained) {
  const double left = std::max(products.square - explained.squaredNorm(), 0.0);
  return static_cast<float>(left / (products.count - kCount));
}

/// The numbers that tables and sums give for a whole window, for the part that lies in the picture.
struct Sums {
  MarkerTemplate::Phase phase = {};
  WindowProducts p = {};
  float mean = 0.0F;    ///< [levels]
  float misfit = 0.0F;  ///< [levels^2]
  bool known = false;   ///< the samples determine all functions
};

Sums sumsAt(const Plane& plane, const MarkerTemplate& marker, const Reader& read, int rim, float x, float y) {
  const auto products = productsAt<kFunctions>(plane, marker, read, rim, x, y,
                                               [&](double dx, double dy) { return marker.functionsAt(dx, dy); });
  Sums sums;
  const Eigen::LLT<Square<kFunctions>> factor(products.functions);
  if (factor.info() != Eigen::Success) return sums;
  sums.known = true;
  sums.phase = MarkerTemplate::phaseOf(factor.matrixU());
  sums.phase.cover = static_cast<float>(products.functions(0, 1) / products.count);
  const Column<kFunctions> p = factor.matrixL().solve(products.levels);  // the first is with the constant
  for (int i = 0; i < MarkerTemplate::kRows; ++i) sums.p[i] = plane.sign * static_cast<float>(p(i + 1));
  sums.mean = static_cast<float>(products.base + products.levels(0) / products.count);
  sums.misfit = leftOver<kFunctions>(products, p);
  return sums;
}

/// The picture in which the disc of a marker must lie completely.
struct Picture {
  Picture(const Plane& plane, const MarkerTemplate& marker, const Guess& guess)
      : radius(static_cast<float>(marker.radius()))
      , rim(guess.mixed && plane.step == 2 ? 1 : 0)
      , low(static_cast<float>(rim) + clippedMargin(marker))
      , highX(static_cast<float>(plane.width - 1) - low)
      , highY(static_cast<float>(plane.height - 1) - low) {}

  bool has(float x, float y) const { return x >= low && x <= highX && y >= low && y <= highY; }

  float radius;
  int rim;  ///< width of the border in which a mosaic lacks neighbours of the other colour
  float low, highX, highY;
};

}  // namespace

void fitClippedCentre(const Plane& plane, const MarkerTemplate& marker, const CrossTalk& crossTalk, const Guess& guess,
                      Centre& centre) {
  const Picture picture(plane, marker, guess);
  const Reader read(plane, crossTalk, guess.mixed);

  float x = (centre.u - plane.u0) / plane.scale, y = (centre.v - plane.v0) / plane.scale;
  const float slopeU = plane.scale * guess.slopeU, slopeV = plane.scale * guess.slopeV;  // per sample
  for (int steps = 0; steps < kMaxSteps; ++steps) {
    if (!picture.has(x, y)) break;
    const Sums sums = sumsAt(plane, marker, read, picture.rim, x, y);
    if (!sums.known) break;
    const TemplateStep step = stepOf(sums.phase, sums.p, slopeU, slopeV, kLongest * picture.radius);
    centre.amplitude = step.amplitude;
    if (!(step.amplitude >= guess.minAmplitude)) break;
    x += step.du;
    y += step.dv;
    if (step.size > kSettled * picture.radius) continue;
    if (!picture.has(x, y)) break;
    const float noise = plane.noise * read.noise();
    describeFound(plane, sums.phase, sums.p, noise, sums.misfit / noise, sums.mean, centre);
    break;
  }
  centre.u = plane.u0 + plane.scale * x;
  centre.v = plane.v0 + plane.scale * y;
}

float clippedAmplitudeAt(const Plane& plane, const MarkerTemplate& marker, float u, float v) {
  const float x = (u - plane.u0) / plane.scale, y = (v - plane.v0) / plane.scale;
  if (!Picture(plane, marker, {}).has(x, y)) return 0.0F;
  const Sums sums = sumsAt(plane, marker, Reader(plane, {}, false), 0, x, y);
  return sums.known ? stepOf(sums.phase, sums.p, 0.0F, 0.0F, 1.0F).amplitude : 0.0F;
}

bool fitDeformedCentre(const Plane& plane, const MarkerTemplate& marker, const CrossTalk& crossTalk, const Guess& guess,
                       Centre& centre) {
  constexpr int kAll = kFunctions + 3;
  const Picture picture(plane, marker, guess);
  const Reader read(plane, crossTalk, guess.mixed);
  const auto functionsAt = [&](double dx, double dy) {
    Eigen::Matrix<double, 1, kAll> all;
    all << marker.functionsAt(dx, dy), marker.deformationsAt(dx, dy);
    return all;
  };
  float x = (centre.u - plane.u0) / plane.scale, y = (centre.v - plane.v0) / plane.scale;
  for (int steps = 0; steps < kMaxSteps && picture.has(x, y); ++steps) {
    const auto products = productsAt<kAll>(plane, marker, read, picture.rim, x, y, functionsAt);
    const Eigen::LLT<Square<kAll>> factor(products.functions);
    if (factor.info() != Eigen::Success) return false;
    const Column<kAll> shares = plane.sign * factor.solve(products.levels);
    const auto amplitude = static_cast<float>(shares(1));
    if (!(amplitude >= guess.minAmplitude)) return false;
    const float du = static_cast<float>(shares(2)) / amplitude, dv = static_cast<float>(shares(3)) / amplitude;
    const float size = std::max(std::abs(du), std::abs(dv));
    if (!(size <= kLongest * picture.radius)) return false;
    x += du;
    y += dv;
    if (size > kSettledExactly) continue;

    const float noise = plane.noise * read.noise();
    const Square<kAll> inverse = factor.solve(Square<kAll>(Square<kAll>::Identity()));
    centre.u = plane.u0 + plane.scale * x;
    centre.v = plane.v0 + plane.scale * y;
    centre.amplitude = amplitude;
    centre.misfit = leftOver<kAll>(products, factor.matrixL().solve(products.levels)) / noise;
    centre.variance = static_cast<float>(0.5 * (inverse(2, 2) + inverse(3, 3))) * noise * plane.scale * plane.scale /
                      (amplitude * amplitude);
    centre.slopeShare = 0.0F;
    return true;
  }
  return false;
}

}  // namespace tractiond::track

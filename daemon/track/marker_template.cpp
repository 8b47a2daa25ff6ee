#include "daemon/track/marker_template.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tractiond::track {

namespace {

constexpr double kProfileStep = 0.02;  // [samples]: cubic interpolation is then exact to 1e-6
constexpr double kCurveStep = 0.1;     // for second differences
constexpr int kStrips = 48;

double normal(double t) {
  return 0.5 * std::erfc(-t / std::numbers::sqrt2);
}

/// Returns the blurred disc at distance r: sums strips across the disc, each blurred exactly along its length.
double blurredDisc(double r, double radius, double blur) {
  double sum = 0.0;
  const double step = std::numbers::pi / kStrips;
  for (int i = 0; i < kStrips / 2; ++i) {  // the other half is its mirror image
    const double angle = (i + 0.5) * step;
    const double y = radius * std::cos(angle), halfLength = radius * std::sin(angle);
    const double across = std::exp(-0.5 * y * y / (blur * blur)) / (blur * std::sqrt(2.0 * std::numbers::pi));
    sum += 2.0 * halfLength * step * across * (normal((r + halfLength) / blur) - normal((r - halfLength) / blur));
  }
  return sum;
}

}  // namespace

MarkerTemplate::MarkerTemplate(double radius, double blur)
    : radius_(std::min(radius, largestRadius())) {
  // The narrowest margin of a window is half - 1. Samples beyond 1.2 deviations outside the disc hold no information;
  // with a margin of a tenth of a deviation 2 % of it is lost. A wider window costs time and overlaps neighbours.
  half_ = std::clamp(1 + static_cast<int>(std::ceil(radius_ + 1.2 * blur - 0.25)), 3, kMaxHalf);
  const int width = 2 * half_;

  const double reach = 1.5 * half_ + 1.0;
  for (double r = 0.0; r < reach; r += kProfileStep) profile_.push_back(blurredDisc(r, radius_, blur));

  weights_.resize(static_cast<std::size_t>(kPhases * kPhases * kRows * samples() / kLanes));
  Eigen::MatrixXd basis(used(), 1 + kRows);
  for (int index = 0; index < kPhases * kPhases; ++index) {
    const double u = static_cast<double>(index % kPhases) / kPhases, v = static_cast<double>(index / kPhases) / kPhases;
    for (int i = 0; i < used(); ++i)
      basis.row(i) = functionsAt(i % width - (half_ - 1) - u, i / width - (half_ - 1) - v);
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(basis);
    const Eigen::MatrixXd q = qr.householderQ() * Eigen::MatrixXd::Identity(used(), 1 + kRows);
    float* rows = weights_.front().lane + index * kRows * samples();
    for (int k = 0; k < kRows; ++k) {
      for (int i = 0; i < used(); ++i) {
        rows[k * samples() + i / width * rowLength(half_) + i % width] = static_cast<float>(q(i, k + 1));
      }
    }
    phases_.push_back(phaseOf(qr.matrixQR().topRows<1 + kRows>()));
    phases_.back().cover = static_cast<float>(basis.col(1).mean());
  }
}

MarkerTemplate::Functions MarkerTemplate::functionsAt(double x, double y) const {
  const double r = std::hypot(x, y);
  const double slope = (at(r + kProfileStep) - at(std::abs(r - kProfileStep))) / (2.0 * kProfileStep);
  const double share = r > 1e-9 ? -slope / r : 0.0;
  const double curve = (at(r + kCurveStep) - 2.0 * at(r) + at(std::abs(r - kCurveStep))) / (kCurveStep * kCurveStep);
  return {1.0, at(r), share * x, share * y, r > 1e-9 ? curve - share : 2.0 * curve, x, y};
}

Eigen::Matrix<double, 1, 3> MarkerTemplate::deformationsAt(double x, double y) const {
  const double r = std::hypot(x, y);
  if (r < 1e-9) return {0.0, 0.0, 0.0};
  const double inward = (at(std::abs(r - kProfileStep)) - at(r + kProfileStep)) / (2.0 * kProfileStep);
  return {inward, inward * (x * x - y * y) / (r * r), inward * 2.0 * x * y / (r * r)};
}

MarkerTemplate::Phase MarkerTemplate::phaseOf(const Triangle& triangle) {
  const Eigen::Matrix3d inverse =
      triangle.block<3, 3>(1, 1).triangularView<Eigen::Upper>().solve(Eigen::Matrix3d(Eigen::Matrix3d::Identity()));
  const Eigen::Matrix2d slopes =
      triangle.block<2, 2>(5, 5).triangularView<Eigen::Upper>().solve(Eigen::Matrix2d(Eigen::Matrix2d::Identity()));
  const Eigen::Matrix<double, 3, 2> lean = inverse * triangle.block<3, 2>(1, 5);
  Phase phase{};
  int next = 0;
  for (int row = 0; row < 3; ++row) {
    for (int column = row; column < 3; ++column) phase.solve[next++] = static_cast<float>(inverse(row, column));
  }
  phase.solveSlope = {static_cast<float>(slopes(0, 0)), static_cast<float>(slopes(0, 1)),
                      static_cast<float>(slopes(1, 1))};
  for (int k = 0; k < 6; ++k) phase.lean[k] = static_cast<float>(lean(k / 2, k % 2));
  phase.variance = static_cast<float>(0.5 * inverse.bottomRows<2>().squaredNorm());
  phase.slopeVariance = static_cast<float>(0.5 * slopes.squaredNorm());
  phase.slopeShare = static_cast<float>(0.5 * (lean.bottomRows<2>() * slopes).squaredNorm());
  return phase;
}

double MarkerTemplate::at(double r) const {
  const double place = r / kProfileStep;
  const auto index = static_cast<std::size_t>(place);
  if (index + 2 >= profile_.size()) return 0.0;
  const double t = place - static_cast<double>(index);
  const double before = profile_[index > 0 ? index - 1 : 1];  // the profile is even
  const double a = profile_[index], b = profile_[index + 1], after = profile_[index + 2];
  return a +
         0.5 * t * (b - before + t * (2.0 * before - 5.0 * a + 4.0 * b - after + t * (3.0 * (a - b) + after - before)));
}

}  // namespace tractiond::track

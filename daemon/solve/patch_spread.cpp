#include "daemon/solve/patch_spread.h"

#include <algorithm>
#include <cmath>

namespace tractiond::solve {
namespace {

/// Variance of the Gaussian that stands for a patch among the points: its spread, but no less than kLeastSpread, and
/// kBlur more [pitches^2].
constexpr double kLeastSpread = 0.02, kBlur = 0.08;
/// Newton's method for the centroid: steps, precision [pitches], least slope of the centroid by the centre.
constexpr int kSteps = 20;
constexpr double kCentred = 1e-10, kLeastSlope = 0.1;
/// Share of the nearest point's force below which a point has nothing of a patch.
constexpr double kNothing = 1e-12;

/// Shares of points side by side in a Gaussian at `at` [pitches], their sum being 1. `centred`: their centroid is
/// there, by Newton's method for the Gaussian's own centre.
void spreadAlong(double at, double variance, bool centred, std::span<double> share) {
  double centre = at;
  for (int step = 0; step <= kSteps; ++step) {
    double sum = 0.0, first = 0.0, second = 0.0;
    for (std::size_t i = 0; i < share.size(); ++i) {
      const double away = static_cast<double>(i) - centre, weight = std::exp(-square(away) / (2.0 * variance));
      share[i] = weight > kNothing ? weight : 0.0;
      sum += share[i];
      first += away * share[i];
      second += square(away) * share[i];
    }
    for (double& each : share) each /= sum;
    const double off = at - (centre + first / sum);
    if (!centred || std::abs(off) < kCentred || step == kSteps) return;
    const double slope = (second / sum - square(first / sum)) / variance;
    centre = std::clamp(centre + off / std::max(slope, kLeastSlope), at - 0.5, at + 0.5);
  }
}

double centroidAlong(std::span<const double> share) {
  double sum = 0.0;
  for (std::size_t i = 0; i < share.size(); ++i) sum += static_cast<double>(i) * share[i];
  return sum;
}

/// Mean squared distance from a place; not 0, as shares spread over the points beside a patch, but for a single point.
double squaredAlong(std::span<const double> share, double from) {
  double sum = 0.0;
  for (std::size_t i = 0; i < share.size(); ++i) sum += square(static_cast<double>(i) - from) * share[i];
  return sum;
}

}  // namespace

PatchSpread::PatchSpread(const Atoms& atoms)
    : atoms_(atoms)
    , along_{std::vector<double>(atoms.columns), std::vector<double>(atoms.rows)}
    , share_(static_cast<std::size_t>(atoms.pointCount())) {}

std::span<const double> PatchSpread::divide(const PatchPlace& place, bool centred) {
  const double pitch2 = square(atoms_.pitch_m);
  const double variance = std::max(place.spread_m2 / pitch2, kLeastSpread) + kBlur;
  const Eigen::Vector2d at = (Eigen::Vector2d(place.x_m, place.y_m) - atoms_.points.col(0).head<2>()) / atoms_.pitch_m;
  const std::span<double> across(along_[0]), up(along_[1]);
  spreadAlong(std::clamp(at.x(), 0.0, atoms_.columns - 1.0), variance, centred, across);
  spreadAlong(std::clamp(at.y(), 0.0, atoms_.rows - 1.0), variance, centred, up);
  for (std::size_t p = 0, row = 0; row < up.size(); ++row) {
    for (const double each : across) share_[p++] = each * up[row];
  }
  const Eigen::Vector2d centroid(centroidAlong(across), centroidAlong(up));
  centroid_m_ = atoms_.points.col(0).head<2>() + atoms_.pitch_m * centroid;
  off_.head<2>() = Eigen::Vector2d(place.x_m, place.y_m) - centroid_m_;
  spread_m2_ = pitch2 * (squaredAlong(across, centroid.x()) + squaredAlong(up, centroid.y()));
  return share_;
}

void PatchSpread::add(const PatchLoad& load, int number, std::span<double> forces) const {
  const double torsion = load[3] / spread_m2_;
  for (std::size_t p = 0; p < share_.size(); ++p) {
    const Eigen::Vector2d arm = atoms_.points.col(p).head<2>() - centroid_m_;
    Eigen::Vector3d::Map(forces.data() + 3 * p) +=
        share_[p] * (load.head<3>() + torsion * Eigen::Vector3d(-arm.y(), arm.x(), 0.0));
  }
  Eigen::Vector3d::Map(forces.data() + 3 * (share_.size() + number)) = off_.cross(load.head<3>());
}

}  // namespace tractiond::solve

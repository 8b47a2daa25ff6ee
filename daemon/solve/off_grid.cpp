#include "daemon/solve/off_grid.h"

#include "sensor/elastic/half_space.h"
#include "sensor/projection.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tractiond::solve {
namespace {

/// Beyond, the difference is nothing [pitches].
constexpr double kReach = 4.0;

/// A point and six around it that have the moments of a ball's pressure up to the fifth: the ring's share of the force,
/// and its squared radius as a multiple of the spread.
constexpr int kRing = 6;
constexpr double kRingShare = 0.7, kRingSquare = 2.0 / kRingShare;

/// For derivatives by place and spread [pitches, pitches^2].
constexpr double kSmall = 0.05;

}  // namespace

OffGrid::OffGrid(const sensor::Sensor& sensor)
    : grid_(sensor.nodes)
    , nodes_(sensor::nodePositions(sensor))
    , markers_(sensor::markerPositions(sensor))
    , youngsModulus_(sensor.gel.youngsModulus)
    , poissonRatio_(sensor.gel.poissonRatio) {
  const sensor::Projection projection(sensor.camera, sensor.gel.size.z());
  for (Eigen::Index m = 0; m < markers_.cols(); ++m) jacobian_.push_back(projection.jacobian(markers_.col(m)));
  difference_.coordinates.reserve(static_cast<std::size_t>(2 * markers_.cols()));
  difference_.kinds.reserve(static_cast<std::size_t>(24 * markers_.cols()));
}

const OffGrid::Difference& OffGrid::of(const Patch& patch, std::span<const int> missing) {
  const Stencil stencil(patch, grid_.columns, grid_.rows);
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < Stencil::kNodes; ++i) centre += stencil.share[i][0] * nodes_.col(stencil.node[i]);
  const auto at = [&](const Eigen::Vector3d& offset) -> Eigen::Matrix3d {
    return sensor::elastic::halfSpaceDisplacement(offset, youngsModulus_, poissonRatio_);
  };
  std::array<Eigen::Vector3d, kRing> ring;
  for (int i = 0; i < kRing; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kRing;
    ring[static_cast<std::size_t>(i)] = {std::cos(angle), std::sin(angle), 0.0};
  }
  // What 1 N of the patch does at `offset` from its centre.
  const auto field = [&](const Eigen::Vector3d& offset, double spread) {
    const double radius = grid_.pitch * std::sqrt(kRingSquare * std::max(spread, 0.0));
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (const Eigen::Vector3d& place : ring) sum += at(offset - radius * place);
    return Eigen::Matrix3d((1.0 - kRingShare) * at(offset) + kRingShare / kRing * sum);
  };

  difference_.coordinates.clear();
  difference_.kinds.clear();
  for (Eigen::Index m = 0; m < markers_.cols(); ++m) {
    const Eigen::Vector3d marker = markers_.col(m), offset = marker - centre;
    if (offset.head<2>().norm() > kReach * grid_.pitch) continue;
    if (std::find(missing.begin(), missing.end(), 2 * static_cast<int>(m)) != missing.end()) continue;
    std::array<Eigen::Matrix3d, 4> kinds;
    kinds[0] = field(offset, patch.spread);
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::Vector3d moved = offset - kSmall * grid_.pitch * Eigen::Vector3d::Unit(axis);
      kinds[1 + static_cast<std::size_t>(axis)] = (field(moved, patch.spread) - kinds[0]) / kSmall;
    }
    kinds[3].setZero();
    if (patch.spread >= 0.0) kinds[3] = (field(offset, patch.spread + kSmall) - kinds[0]) / kSmall;
    for (std::size_t i = 0; i < Stencil::kNodes; ++i) {
      const Eigen::Matrix3d node = at(marker - nodes_.col(stencil.node[i]));
      for (std::size_t k = 0; k < 4; ++k) kinds[k] -= stencil.share[i][k] * node;
    }
    std::array<Eigen::Matrix<double, 2, 3>, 4> seen;
    for (std::size_t k = 0; k < 4; ++k) seen[k] = jacobian_[static_cast<std::size_t>(m)] * kinds[k];
    for (int row = 0; row < 2; ++row) {
      difference_.coordinates.push_back(2 * static_cast<int>(m) + row);
      for (int axis = 0; axis < 3; ++axis) {
        for (std::size_t k = 0; k < 4; ++k) difference_.kinds.push_back(seen[k](row, axis));
      }
    }
  }
  return difference_;
}

}  // namespace tractiond::solve

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

}  // namespace

OffGrid::OffGrid(const sensor::Sensor& sensor, int stride)
    : grid_(sensor.nodes)
    , nodes_(sensor::nodePositions(sensor))
    , markers_(sensor::markerPositions(sensor))
    , youngsModulus_(sensor.gel.youngsModulus)
    , poissonRatio_(sensor.gel.poissonRatio)
    , displacement_(static_cast<std::size_t>(stride)) {
  const sensor::Projection projection(sensor.camera, sensor.gel.size.z());
  for (Eigen::Index m = 0; m < markers_.cols(); ++m) jacobian_.push_back(projection.jacobian(markers_.col(m)));
}

Picture OffGrid::without(const Patch& patch, const Picture& picture, double share) {
  struct Source {
    Eigen::Vector3d at, force;
  };
  std::array<Source, 1 + kRing + Stencil::kNodes> sources;
  const Stencil stencil(patch, grid_.columns, grid_.rows);
  const Eigen::Vector3d force = share * Eigen::Vector3d::Map(patch.force_N.data());
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  auto source = sources.begin();
  for (std::size_t i = 0; i < Stencil::kNodes; ++i) {
    const Eigen::Vector3d at = nodes_.col(stencil.node[i]);
    centre += stencil.share[i][0] * at;
    *source++ = {at, -stencil.share[i][0] * force};
  }
  const double radius = grid_.pitch * std::sqrt(kRingSquare * std::max(patch.spread, 0.0));
  *source++ = {centre, (1.0 - kRingShare) * force};
  for (int i = 0; i < kRing; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kRing;
    *source++ = {centre + radius * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0), kRingShare / kRing * force};
  }

  std::copy_n(picture.displacement_px, displacement_.size(), displacement_.begin());
  for (Eigen::Index m = 0; m < markers_.cols(); ++m) {
    const Eigen::Vector3d marker = markers_.col(m);
    if ((marker - centre).head<2>().norm() > kReach * grid_.pitch) continue;
    Eigen::Vector3d difference = Eigen::Vector3d::Zero();
    for (const Source& s : sources) {
      difference += sensor::elastic::halfSpaceDisplacement(marker - s.at, youngsModulus_, poissonRatio_) * s.force;
    }
    const Eigen::Vector2d seen = jacobian_[static_cast<std::size_t>(m)] * difference;
    for (const int axis : {0, 1}) displacement_[static_cast<std::size_t>(2 * m + axis)] -= seen[axis];
  }
  for (const int coordinate : picture.missing) displacement_[static_cast<std::size_t>(coordinate)] = 0.0;
  Picture result = picture;
  result.displacement_px = displacement_.data();
  result.squares_px2 = dotProduct(displacement_.data(), displacement_.data(), static_cast<int>(displacement_.size()));
  return result;
}

}  // namespace tractiond::solve

#include "daemon/solve/shear_spread.h"

#include <algorithm>
#include <cmath>

namespace tractiond::solve {

using Eigen::Index, Eigen::VectorXd;

ShearSpread::ShearSpread(const Factors& factors)
    : coordinates_(factors.coordinateCount())
    , ofXi_(LinearPosterior::kMostRank)
    , shared_(LinearPosterior::kMostRank) {
  for (Slopes& each : slopes_) {
    for (auto& column : each.px_m2) column = LineArray<double>(static_cast<std::size_t>(factors.influence.stride()));
    for (auto& column : each.ofXi) column.resize(LinearPosterior::kMostRank);
  }
}

void ShearSpread::make(const LinearPosterior& posterior, const FreedPatches& patches, const RoundPatches& fit,
                       std::span<const int> missing) {
  for (int k = 0; k < patches.count(); ++k) {
    Slopes& slopes = slopes_[static_cast<std::size_t>(k)];
    for (std::size_t axis = 0; axis < 2; ++axis) {
      double* const column = slopes.px_m2[axis].data();
      fit.shearSlope(k, static_cast<int>(axis), column);
      for (const int coordinate : missing) column[coordinate] = 0.0;
      posterior.readColumn(column, slopes.ofXi[axis]);
    }
    const auto product = [&](std::size_t a, std::size_t b) {
      return dotProduct(slopes.px_m2[a].data(), slopes.px_m2[b].data(), coordinates_);
    };
    slopes.products << product(0, 0), product(0, 1), product(1, 0), product(1, 1);
  }
}

ShearExcess ShearSpread::find(const LinearPosterior& posterior, int patch, const RoundPatch& now,
                              const double* displacement_px, double noise_px, std::span<const int> added) {
  const double spread = std::max(now.place.spread_m2, 0.0);
  if (spread == 0.0) return {};
  const Slopes& slopes = slopes_[static_cast<std::size_t>(patch)];
  const auto rank = static_cast<Index>(posterior.rank());
  const Eigen::Vector2d shear = now.load.head<2>();
  auto ofXi = VectorXd::Map(ofXi_.data(), rank);
  ofXi =
      shear.x() * VectorXd::Map(slopes.ofXi[0].data(), rank) + shear.y() * VectorXd::Map(slopes.ofXi[1].data(), rank);
  double squares = shear.dot(slopes.products * shear), along = 0.0;
  for (Index axis = 0; axis < 2; ++axis) {
    along +=
        shear[axis] * dotProduct(slopes.px_m2[static_cast<std::size_t>(axis)].data(), displacement_px, coordinates_);
  }
  for (const int coordinate : added) {
    const double there =
        shear.x() * slopes.px_m2[0].data()[coordinate] + shear.y() * slopes.px_m2[1].data()[coordinate];
    squares -= square(there);
    posterior.subtractAt(coordinate, there, ofXi_);
  }
  ofXi *= square(posterior.noise_px() / noise_px);
  shared_ = ofXi_;
  posterior.multiplyCovariance(shared_);
  const auto shared = VectorXd::Map(shared_.data(), rank);
  const double precision = squares / square(noise_px) - ofXi.dot(shared) + 1.0 / square(spread);
  if (!(precision > 0.0)) return {};
  const double shown = along / square(noise_px) - ofXi.dot(VectorXd::Map(posterior.xi().data(), rank));
  return {shown / precision, 1.0 / std::sqrt(precision)};
}

}  // namespace tractiond::solve

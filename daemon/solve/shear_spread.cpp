#include "daemon/solve/shear_spread.h"

#include <algorithm>
#include <cmath>

namespace tractiond::solve {
namespace {

/// What is found farther than this from the edge of a patch is not of its contact [pitches].
constexpr double kBeside = 1.5;

}  // namespace

using Eigen::Index, Eigen::VectorXd;

ShearSpread::ShearSpread(const Factors& factors, const Atoms& atoms)
    : atoms_(atoms)
    , coordinates_(factors.coordinateCount())
    , ofXi_(LinearPosterior::kMostRank)
    , shared_(LinearPosterior::kMostRank)
    , away_m2_(atoms.pointCount())
    , shares_(atoms.count()) {
  for (Slopes& each : slopes_) {
    for (auto& column : each.px_m2) column = LineArray<double>(factors.influence.stride());
    for (auto& column : each.ofXi) column.resize(LinearPosterior::kMostRank);
  }
}

void ShearSpread::make(const LinearPosterior& posterior, const FreedPatches& patches, const RoundPatches& fit,
                       std::span<const int> missing) {
  for (int k = 0; k < patches.count(); ++k) {
    Slopes& slopes = slopes_[k];
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

/// Computes e. Leaves in shared_ by how much xi is less for a unit of it.
ShearSpread::Excess ShearSpread::excess(const LinearPosterior& posterior, int patch, const RoundPatch& now,
                                        const double* displacement_px, double noise_px, std::span<const int> added) {
  const Slopes& slopes = slopes_[patch];
  const auto rank = static_cast<Index>(posterior.rank());
  const Eigen::Vector2d shear = now.load.head<2>();
  auto ofXi = VectorXd::Map(ofXi_.data(), rank);
  ofXi =
      shear.x() * VectorXd::Map(slopes.ofXi[0].data(), rank) + shear.y() * VectorXd::Map(slopes.ofXi[1].data(), rank);
  double squares = shear.dot(slopes.products * shear), along = 0.0;
  for (Index axis = 0; axis < 2; ++axis) {
    along += shear[axis] * dotProduct(slopes.px_m2[axis].data(), displacement_px, coordinates_);
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
  const double precision = squares / square(noise_px) - ofXi.dot(shared) + 1.0 / square(now.place.spread_m2);
  const double shown = along / square(noise_px) - ofXi.dot(VectorXd::Map(posterior.xi().data(), rank));
  return {shown / precision, 1.0 / precision};
}

/// Finds which points are those of the contact of a patch: at it, and nearer to it than to another one.
void ShearSpread::weighPoints(std::span<const RoundPatch> now, int patch) {
  const auto squaredDistance = [&](Eigen::Index point, const RoundPatch& from) {
    return square(atoms_.points(0, point) - from.place.x_m) + square(atoms_.points(1, point) - from.place.y_m);
  };
  const RoundPatch& here = now[patch];
  const double reach_m = std::sqrt(5.0 * here.place.spread_m2) + kBeside * atoms_.pitch_m;
  for (std::size_t p = 0; p < away_m2_.size(); ++p) {
    const auto point = static_cast<Eigen::Index>(p);
    const double squared = squaredDistance(point, here);
    const bool isHere = squared < square(reach_m) && std::all_of(now.begin(), now.end(), [&](const RoundPatch& other) {
                          return squared <= squaredDistance(point, other);
                        });
    away_m2_[p] = isHere ? 0.5 * squared : -1.0;
  }
}

SpreadRatio ShearSpread::find(const LinearPosterior& posterior, const FreedPatches& freed,
                              std::span<const RoundPatch> now, int patch, double grown, const double* displacement_px,
                              double noise_px, std::span<const int> added) {
  const auto& [place, load] = now[patch];
  if (!(place.spread_m2 > 0.0)) return {};
  const auto [e_m2, variance_m4] = excess(posterior, patch, now[patch], displacement_px, noise_px, added);
  if (!(variance_m4 > 0.0)) return {};
  weighPoints(now, patch);
  // Sum, and half the second moment, of shear and pressure: of the patch, and of the atoms at it.
  const double patchShear_N = load.head<2>().norm();
  const Eigen::Vector3d along(load.x() / patchShear_N, load.y() / patchShear_N, 0.0);
  double shear_N = patchShear_N, pressing_N = load.z();
  double ofShear = shear_N * place.spread_m2, ofPressure = pressing_N * place.spread_m2;
  const auto shares = std::span(shares_).first(posterior.atoms().size());
  std::fill(shares.begin(), shares.end(), std::array{0.0, 0.0});
  for (std::size_t p = 0; p < away_m2_.size(); ++p) {
    if (away_m2_[p] < 0.0) continue;
    const auto [atoms, ofPoint] = posterior.sharing(p);
    for (std::size_t k = 0; k < atoms.size(); ++k) {
      auto& [sum, moment] = shares[atoms[k]];
      sum += ofPoint[k];
      moment += ofPoint[k] * away_m2_[p];
    }
  }
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const auto [sum, moment] = shares[i];
    if (sum == 0.0) continue;
    const Eigen::Vector3d force_N = posterior.atomForce_N(i);
    shear_N += sum * along.dot(force_N);
    pressing_N += sum * force_N.z();
    ofShear += moment * along.dot(force_N);
    ofPressure += moment * force_N.z();
  }
  if (!(shear_N > 0.0) || !(pressing_N > 0.0) || !(ofShear > 0.0) || !(ofPressure > 0.0)) return {};
  const double ratio = ofShear / shear_N / (ofPressure / pressing_N);
  // How the logarithm of the ratio changes with xi, by the unknowns that act at the contact.
  const Eigen::MatrixXd& unknowns = posterior.unknownsOfXi();
  auto ofXi = VectorXd::Map(ofXi_.data(), static_cast<Index>(posterior.rank()));
  ofXi.setZero();
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const auto [sum, moment] = shares[i];
    if (sum == 0.0) continue;
    const Eigen::Vector3d ofForce = (moment / ofShear - sum / shear_N) * along -
                                    (moment / ofPressure - sum / pressing_N) * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d ofTheta = posterior.root(static_cast<int>(i)).transpose() * ofForce;
    ofXi.noalias() += unknowns.middleCols<3>(3 * static_cast<Index>(i)) * ofTheta;
  }
  const auto add = [&](int i, double ofUnit) {
    ofXi += freed.unit(patch, i) * ofUnit * unknowns.col(posterior.firstExtra() + freed.index(patch, i));
  };
  const Eigen::Vector3d ofLoad = (place.spread_m2 / ofShear - 1.0 / shear_N) * along -
                                 (place.spread_m2 / ofPressure - 1.0 / pressing_N) * Eigen::Vector3d::UnitZ();
  for (int i = 0; i < 3; ++i) add(i, ofLoad[i]);
  add(6, (patchShear_N / ofShear - load.z() / ofPressure) / grown);
  const double slope = patchShear_N / ofShear - ofXi.dot(VectorXd::Map(shared_.data(), ofXi.size()));
  std::copy_n(ofXi_.begin(), ofXi.size(), shared_.begin());
  posterior.multiplyCovariance(shared_);
  const double variance = square(slope) * variance_m4 + ofXi.dot(VectorXd::Map(shared_.data(), ofXi.size()));
  const SpreadRatio found{ratio * (1.0 + slope * e_m2), ratio * std::sqrt(variance)};
  return std::isfinite(found.value) && std::isfinite(found.deviation) ? found : SpreadRatio{};
}

}  // namespace tractiond::solve

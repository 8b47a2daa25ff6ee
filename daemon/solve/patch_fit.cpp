// Everything happens among the products of the influence matrix: a patch is a few shares of the nodes around it, so
// that its products with itself, with others and with the displacements are short sums over H'H and H'd. For given
// places the forces are linear: their equations are the leading block of a Gauss-Newton step's, which asks for forces,
// motion and the change of the places together. A step that leaves more than before is taken back and damped.
#include "daemon/solve/patch_fit.h"

#include "daemon/solve/stencil.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace tractiond::solve {
namespace {

/// Bounds of a spread [pitches^2]: interpolation may want a little less than none, and stencils are too narrow for
/// more.
constexpr double kNarrowest = -0.15, kWidest = 1.2;

/// A step goes no farther [pitches, pitches^2].
constexpr double kFarthest = 0.7, kFarthestSpread = 0.3;

/// From a node's product with a smaller weight, the product itself is not taken.
constexpr double kLeastWeight = 1e-3;

/// Steps at most, and the gain of one, in squared deviations, that is the last.
constexpr int kSteps = 16;
constexpr double kLastGain = 0.02;

/// Where so many times the expected gain is not enough, none will be.
constexpr double kHope = 3.0;

/// Damping of the places after a step that failed: the least, by what it changes, and where to give up.
constexpr double kDamping = 0.1, kDampingFactor = 10.0, kMostDamping = 1e4;

/// Along a bar, Gauss's four points in (0, 1) and their weights.
constexpr std::array<double, 4> kBarPlace = {0.0694318442, 0.3300094782, 0.6699905218, 0.9305681558};
constexpr std::array<double, 4> kBarWeight = {0.1739274226, 0.3260725774, 0.3260725774, 0.1739274226};

}  // namespace

PatchFit::PatchFit(const Inverse& inverse, const sensor::NodeGrid& nodes)
    : inverse_(inverse)
    , columns_(nodes.columns)
    , rows_(nodes.rows)
    , products_(static_cast<std::size_t>(inverse.forceCount()))
    , asked_(static_cast<std::size_t>(nodes.count()))
    , missing_(static_cast<std::size_t>(kMostSpots * kKinds * inverse.coordinateCount()))
    , motionMissing_(static_cast<std::size_t>(kMotions * inverse.coordinateCount()))
    , near_(static_cast<std::size_t>(kKinds * inverse.coordinateCount()))
    , sum_(near_.size())
    , motionNear_(motionMissing_.size()) {}

int PatchFit::unknown(int end, int i) const {
  return i < 3 ? 3 * end + i : 3 * ends_ + kMotions + 3 * end + i - 3;
}

void PatchFit::begin(const ContactStep& step, const Picture& picture) {
  step_ = &step;
  picture_ = picture;
  std::fill(asked_.begin(), asked_.end(), std::uint8_t{0});
  const auto nodes = step.nodes();
  const auto products = step.products();
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const int node = nodes[i];
    if (step.weights()[node] < kLeastWeight) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      products_[3 * static_cast<std::size_t>(node) + axis] = products[3 * i + axis] / step.weights()[node];
    }
    asked_[node] = 1;
  }
  const auto gone = static_cast<Eigen::Index>(picture.missing.size());
  Eigen::Map<Eigen::Matrix<double, kMotions, Eigen::Dynamic>> missing(motionMissing_.data(), kMotions, gone);
  for (int k = 0; k < kMotions; ++k) {
    motionRight_[k] = products[3 * nodes.size() + static_cast<std::size_t>(k)];
    for (Eigen::Index i = 0; i < gone; ++i) missing(k, i) = inverse_.motion.row(k)[picture.missing[i]];
  }
  motionGram_ = Eigen::Map<const Eigen::Matrix<double, kMotions, kMotions>>(step.motionGram().data());
  motionGram_ -= missing.lazyProduct(missing.transpose());
}

/// The spots of these patches.
void PatchFit::lay(std::span<const Patch> patches, int bar) {
  ends_ = static_cast<int>(patches.size());
  spots_ = 0;
  const auto add = [&](int a, int b, double place, double forceA, double forceB) {
    Spot& spot = spot_[spots_++];
    spot.end = {a, b};
    spot.place = {1.0 - place, place};
    spot.force = {forceA, forceB};
    const Patch &p = patches[a], &q = patches[b];
    const auto between = [place](double from, double to) { return from + place * (to - from); };
    spot.stencil =
        Stencil({between(p.column, q.column), between(p.row, q.row), between(p.spread, q.spread), {}}, columns_, rows_);
  };
  for (int end = 0; end < ends_; ++end) {
    if (bar >= 0 && end == bar + 1) continue;
    if (end != bar) {
      add(end, end, 0.0, 1.0, 0.0);
      continue;
    }
    for (std::size_t i = 0; i < kBarPlace.size(); ++i) {
      const double place = kBarPlace[i], weight = kBarWeight[i];
      add(end, end + 1, place, 2.0 * (1.0 - place) * weight, 2.0 * place * weight);
    }
  }
}

/// Products of a spot with the displacements and motions; what it does where markers are missing.
void PatchFit::look(Spot& spot, double* missing) {
  spot.right.setZero();
  spot.motion.setZero();
  const auto gone = picture_.missing.size();
  std::fill(missing, missing + kKinds * gone, 0.0);
  for (std::size_t i = 0; i < Stencil::kNodes; ++i) {
    const int node = spot.stencil.node[i];
    double* const products = products_.data() + 3 * node;
    if (asked_[node] == 0) {
      const std::array<int, 3> rows = {3 * node, 3 * node + 1, 3 * node + 2};
      multiplyRows(inverse_.influence, rows, picture_.displacement_px, products);
      asked_[node] = 1;
    }
    for (int axis = 0; axis < 3; ++axis) {
      const int force = 3 * node + axis;
      const double* const coupling = step_->motionCoupling().data() + kMotions * force;
      for (int k = 0; k < 4; ++k) {
        const double share = spot.stencil.share[i][static_cast<std::size_t>(k)];
        spot.right[3 * k + axis] += share * products[axis];
        for (int j = 0; j < kMotions; ++j) spot.motion(3 * k + axis, j) += share * coupling[j];
      }
      if (gone > 0)
        addShares(inverse_.influence.row(force), picture_.missing, spot.stencil.share[i], missing + 4 * axis);
    }
  }
  if (gone > 0) subtractMotions(missing, motionMissing_.data(), gone, spot.motion.data());
}

/// Adds to the only spot's products what the patch does more than its nodes: near it, (U + D)'(U + D) for U'U.
void PatchFit::addDifference(const Patch& patch) {
  const auto& [coordinates, difference] = offGrid_->of(patch, picture_.missing);
  Spot& spot = spot_[0];
  const std::size_t count = coordinates.size();
  std::fill_n(near_.begin(), kKinds * count, 0.0);
  for (std::size_t i = 0; i < Stencil::kNodes; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      addShares(inverse_.influence.row(3 * spot.stencil.node[i] + axis), coordinates, spot.stencil.share[i],
                near_.data() + 4 * axis);
    }
  }
  for (std::size_t j = 0; j < count; ++j) {
    for (std::size_t e = 0; e < kKinds; ++e) {
      sum_[kKinds * j + e] = near_[kKinds * j + e] + difference[kKinds * j + e];
      spot.right[static_cast<Eigen::Index>(3 * (e % 4) + e / 4)] +=
          difference[kKinds * j + e] * picture_.displacement_px[coordinates[j]];
    }
    for (int k = 0; k < kMotions; ++k)
      motionNear_[kMotions * j + static_cast<std::size_t>(k)] = inverse_.motion.row(k)[coordinates[j]];
  }
  double* const block = block_[0].data();
  subtractProducts(near_.data(), near_.data(), count, block);
  for (std::size_t i = 0; i < kKinds * count; ++i) near_[i] = -sum_[i];
  subtractProducts(near_.data(), sum_.data(), count, block);
  for (std::size_t i = 0; i < kKinds * count; ++i) near_[i] = -difference[i];
  subtractMotions(near_.data(), motionNear_.data(), count, spot.motion.data());
}

/// The equations of the forces and the motion alone; or of everything, for which the forces must be known.
void PatchFit::assemble(std::span<const Patch> patches, bool places) {
  const int size = (places ? 6 : 3) * ends_ + kMotions, forces = 3 * ends_;
  Matrix& normal = places ? normal_ : linear_;
  Vector& right = places ? right_ : linearRight_;
  normal.setZero(size, size);
  right.setZero(size);
  const double noise2 = square(picture_.noise_px);

  // What the unknowns of a spot (force and place) do among its kinds.
  const int local = places ? 6 : 3;
  using Local = Eigen::Matrix<double, kKinds, 6>;
  std::array<Local, kMostSpots> does;
  for (int p = 0; p < spots_; ++p) {
    const Spot& spot = spot_[p];
    does[p].setZero();
    does[p].topLeftCorner<3, 3>().setIdentity();
    for (int axis = 0; axis < 3 && places; ++axis) {
      const double force = spot.force[0] * patches[spot.end[0]].force_N[axis] +  //
                           spot.force[1] * patches[spot.end[1]].force_N[axis];
      for (int k = 1; k < 4; ++k) does[p](3 * k + axis, 2 + k) = force;
    }
  }
  const auto share = [](const Spot& spot, std::size_t end, int i) { return i < 3 ? spot.force[end] : spot.place[end]; };
  const auto eachEnd = [](const Spot& spot, auto use) {
    use(std::size_t{0});
    if (spot.end[1] != spot.end[0]) use(std::size_t{1});
  };
  for (int p = 0; p < spots_; ++p) {
    const Spot& a = spot_[p];
    const Eigen::Matrix<double, 6, 1> with = does[p].transpose().lazyProduct(a.right);
    const Eigen::Matrix<double, 6, kMotions> motion = does[p].transpose().lazyProduct(a.motion);
    eachEnd(a, [&](std::size_t end) {
      for (int i = 0; i < local; ++i) {
        const int to = unknown(a.end[end], i);
        right[to] += share(a, end, i) * with[i];
        for (int k = 0; k < kMotions; ++k) normal(to, forces + k) += share(a, end, i) * motion(i, k);
      }
    });
    for (int q = 0; q <= p; ++q) {
      const Spot& b = spot_[q];
      Eigen::Matrix<double, 6, 6> product;
      if (places) {
        const Eigen::Matrix<double, kKinds, 6> half = block_[p * (p + 1) / 2 + q].lazyProduct(does[q]);
        product = does[p].transpose().lazyProduct(half);
      } else {
        product.topLeftCorner<3, 3>() = block_[p * (p + 1) / 2 + q].topLeftCorner<3, 3>();
      }
      eachEnd(a, [&](std::size_t ea) {
        eachEnd(b, [&](std::size_t eb) {
          for (int i = 0; i < local; ++i) {
            for (int j = 0; j < local; ++j) {
              const double value = share(a, ea, i) * share(b, eb, j) * product(i, j);
              const int to = unknown(a.end[ea], i), from = unknown(b.end[eb], j);
              normal(to, from) += value;
              if (p != q) normal(from, to) += value;
            }
          }
        });
      });
    }
  }

  normal.block(forces, 0, kMotions, size) = normal.block(0, forces, size, kMotions).transpose().eval();
  normal.block(forces, forces, kMotions, kMotions) = motionGram_;
  right.segment(forces, kMotions) = motionRight_;
  for (int k = 0; k < kMotions; ++k) {
    const int i = forces + k;
    if (const double variance = inverse_.motionVariance[k]; variance > 0.0) {
      normal(i, i) += noise2 / variance;
    } else {  // that motion does not happen
      normal.row(i).setZero();
      normal.col(i).setZero();
      normal(i, i) = 1.0;
      right[i] = 0.0;
    }
  }
  for (int end = 0; end < ends_ && places; ++end) {
    const int i = unknown(end, 5);
    normal(i, i) += noise2 / square(kSpreadDeviation);
    right[i] += noise2 * (kSpread - patches[end].spread) / square(kSpreadDeviation);
  }
}

/// Finds the forces at these places and what they leave. False: they cannot be told apart.
bool PatchFit::evaluate(std::span<Patch> patches, int bar) {
  lay(patches, bar);
  const auto gone = picture_.missing.size();
  const auto missing = [&](int p) { return missing_.data() + static_cast<std::size_t>(kKinds * p) * gone; };
  for (int p = 0; p < spots_; ++p) {
    look(spot_[p], missing(p));
    for (int q = 0; q <= p; ++q) {
      // Rows of doubles are Eigen's columns: what is multiplied the other way round comes out right.
      double* const block = block_[p * (p + 1) / 2 + q].data();
      multiplyStencils(spot_[q].stencil, spot_[p].stencil, inverse_.gram.data(), block);
      if (gone > 0) subtractProducts(missing(p), missing(q), gone, block);
    }
  }
  if (offGrid_ != nullptr) addDifference(patches[0]);
  assemble(patches, false);
  const Eigen::LLT<Matrix> factor(linear_);
  if (factor.info() != Eigen::Success) return false;
  const Vector solution = factor.solve(linearRight_);
  const double left = picture_.squares_px2 - solution.dot(linearRight_);
  chiSquared_ = left / square(picture_.noise_px);
  for (int end = 0; end < ends_; ++end) {
    for (int axis = 0; axis < 3; ++axis) patches[end].force_N[axis] = solution[3 * end + axis];
    chiSquared_ += square((patches[end].spread - kSpread) / kSpreadDeviation);
  }
  return std::isfinite(chiSquared_);
}

/// What the step to `solution` gains if everything is linear, in squared deviations.
double PatchFit::expectedGain(std::span<const Patch> patches, const Vector& solution) const {
  double then = (picture_.squares_px2 - solution.dot(right_)) / square(picture_.noise_px);
  for (const Patch& patch : patches) then += square((patch.spread - kSpread) / kSpreadDeviation);
  return chiSquared_ - then;
}

/// To where the solution says, or as far as it is good for.
void PatchFit::move(std::span<const Patch> patches, const Vector& solution, std::span<Patch> to) const {
  const int places = 3 * ends_ + kMotions;
  double shorten = 1.0;
  for (int i = 0; i < 3 * ends_; ++i) {
    const double farthest = i % 3 == 2 ? kFarthestSpread : kFarthest;
    shorten = std::min(shorten, farthest / std::max(std::abs(solution[places + i]), 1e-9));
  }
  for (int end = 0; end < ends_; ++end) {
    const double* const change = solution.data() + places + 3 * end;
    Patch& patch = to[end];
    patch.column = std::clamp(patches[end].column + shorten * change[0], -0.5, columns_ - 0.5);
    patch.row = std::clamp(patches[end].row + shorten * change[1], -0.5, rows_ - 0.5);
    patch.spread = std::clamp(patches[end].spread + shorten * change[2], kNarrowest, kWidest);
  }
}

bool PatchFit::fit(std::span<Patch> patches, double most) {
  if (!descend(patches, -1, most, 0.0)) return false;
  const Eigen::LLT<Matrix> factor(normal_);
  if (factor.info() != Eigen::Success) return false;
  covariance_ = factor.solve(Matrix::Identity(normal_.rows(), normal_.cols()));
  covariance_ *= square(picture_.noise_px);
  return true;
}

bool PatchFit::fit(Patch& patch, double most, OffGrid& offGrid) {
  offGrid_ = &offGrid;
  const bool found = fit({&patch, 1}, most);
  offGrid_ = nullptr;
  return found;
}

bool PatchFit::fitsBar(std::span<Patch> patches, int first, double most) {
  assert(first + 1 < static_cast<int>(patches.size()));
  return descend(patches, first, most, most);
}

/// Steps until nothing is gained, or less than `enough` is left. False: it is not, or will not be, less than `most`.
bool PatchFit::descend(std::span<Patch> patches, int bar, double most, double enough) {
  assert(static_cast<int>(patches.size()) <= kMostPatches);
  if (columns_ < 4 || rows_ < 4 || !evaluate(patches, bar)) return false;
  assemble(patches, true);
  std::array<Patch, kMostPatches> tried;
  const std::span<Patch> trial(tried.data(), patches.size());
  double damping = 0.0;
  for (int step = 0; step < kSteps && chiSquared_ >= enough; ++step) {
    const double before = chiSquared_;
    Matrix damped = normal_;
    damped.diagonal().tail(3 * ends_) *= 1.0 + damping;
    const Eigen::LLT<Matrix> factor(damped);
    if (factor.info() != Eigen::Success) return false;
    const Vector solution = factor.solve(right_);
    if (damping == 0.0 && before - kHope * expectedGain(patches, solution) > most) return false;
    move(patches, solution, trial);
    const bool solved = evaluate(trial, bar);
    if (!solved || !(chiSquared_ < before)) {
      const bool settled = solved && chiSquared_ - before < kLastGain;
      chiSquared_ = before;
      if (settled) break;
      damping = std::max(damping * kDampingFactor, kDamping);
      if (damping > kMostDamping) return false;
      continue;
    }
    std::copy(trial.begin(), trial.end(), patches.begin());
    assemble(patches, true);
    if (before - chiSquared_ < kLastGain) break;
    damping /= kDampingFactor;
  }
  return chiSquared_ < most;
}

Eigen::Matrix<double, 6, 6> PatchFit::covariance(int patch) const {
  Eigen::Matrix<double, 6, 6> result;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) result(i, j) = covariance_(unknown(patch, i), unknown(patch, j));
  }
  return result;
}

}  // namespace tractiond::solve

// Everything happens among the products of the influence matrix: a patch is a few shares of the nodes around it, so
// that its products with itself, with others and with the displacements are short sums over H'H and H'd. For given
// places the forces are linear: their equations are the leading block of a Gauss-Newton step's, which asks for forces,
// motion and the change of the places together. A step that leaves more than before is taken back and damped.
#include "daemon/solve/patch_fit.h"

#include "base/vector_clones.h"

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

/// Cubics through 0, 1, 2, 3 that are 1 at one of them and 0 at the others, and their first three derivatives, at s.
using Cubics = std::array<std::array<double, 4>, 4>;  // of each derivative, of each node
Cubics cubics(double s) {
  constexpr double kCoefficients[4][4] = {{1.0, -11.0 / 6.0, 1.0, -1.0 / 6.0},
                                          {0.0, 3.0, -2.5, 0.5},
                                          {0.0, -1.5, 2.0, -0.5},
                                          {0.0, 1.0 / 3.0, -0.5, 1.0 / 6.0}};
  Cubics result;
  for (std::size_t node = 0; node < 4; ++node) {
    const auto& c = kCoefficients[node];
    result[0][node] = c[0] + s * (c[1] + s * (c[2] + s * c[3]));
    result[1][node] = c[1] + s * (2.0 * c[2] + s * 3.0 * c[3]);
    result[2][node] = 2.0 * c[2] + 6.0 * s * c[3];
    result[3][node] = 6.0 * c[3];
  }
  return result;
}

using Four = double __attribute__((vector_size(32)));

/// block[12 (3 k + x) + 3 l + y] = sum over the nodes i of a and j of b of a.share[i][k] b.share[j][l] times the
/// element of H'H at (3 i + x, 3 j + y); `gram` is its packed lower triangle.
TRACTION_VECTOR_CLONES
void multiplyStencils(const Stencil& a, const Stencil& b, const double* gram, double* block) {
  Four sums[4][9] = {};
  for (std::size_t i = 0; i < Stencil::kNodes; ++i) {
    Four row[9] = {};
    for (std::size_t j = 0; j < Stencil::kNodes; ++j) {
      Four share;
      __builtin_memcpy(&share, b.share[j].data(), sizeof share);
      const std::ptrdiff_t n = 3 * a.node[i], m = 3 * b.node[j];
      const std::ptrdiff_t high = n > m ? n : m, low = n > m ? m : n;
      const double* const first = gram + high * (high + 1) / 2 + low;
      const double* const second = first + high + 1;
      const double* const third = second + high + 2;
      if (n > m) {
        for (int c = 0; c < 3; ++c) {
          row[c] += first[c] * share;
          row[3 + c] += second[c] * share;
          row[6 + c] += third[c] * share;
        }
      } else if (n < m) {
        for (int c = 0; c < 3; ++c) {
          row[3 * c] += first[c] * share;
          row[3 * c + 1] += second[c] * share;
          row[3 * c + 2] += third[c] * share;
        }
      } else {  // the triangle ends at the diagonal
        row[0] += first[0] * share;
        row[1] += second[0] * share;
        row[2] += third[0] * share;
        row[3] += second[0] * share;
        row[4] += second[1] * share;
        row[5] += third[1] * share;
        for (int c = 0; c < 3; ++c) row[6 + c] += third[c] * share;
      }
    }
    for (std::size_t k = 0; k < 4; ++k) {
      for (int e = 0; e < 9; ++e) sums[k][e] += a.share[i][k] * row[e];
    }
  }
  for (int k = 0; k < 4; ++k) {
    for (int e = 0; e < 9; ++e) {
      for (int l = 0; l < 4; ++l) block[(3 * k + e / 3) * 12 + 3 * l + e % 3] = sums[k][e][l];
    }
  }
}

/// to[12 j + 0 .. 3] += row[columns[j]] share, `to` pointing to a component's place.
TRACTION_VECTOR_CLONES
void addShares(const float* row, std::span<const int> columns, const std::array<double, 4>& share, double* to) {
  Four factor, sum;
  __builtin_memcpy(&factor, share.data(), sizeof factor);
  for (const int column : columns) {
    __builtin_memcpy(&sum, to, sizeof sum);
    sum += static_cast<double>(row[column]) * factor;
    __builtin_memcpy(to, &sum, sizeof sum);
    to += 12;
  }
}

/// block[12 (3 l + y) + 3 k + x] -= sum over j < count of a[12 j + 4 x + k] b[12 j + 4 y + l].
TRACTION_VECTOR_CLONES
void subtractProducts(const double* a, const double* b, std::size_t count, double* block) {
  for (std::size_t x = 0; x < 3; ++x) {
    Four sums[4][3] = {}, right[3];
    for (std::size_t j = 0; j < count; ++j) {
      __builtin_memcpy(right, b + 12 * j, sizeof right);
      for (std::size_t k = 0; k < 4; ++k) {
        for (std::size_t y = 0; y < 3; ++y) sums[k][y] += a[12 * j + 4 * x + k] * right[y];
      }
    }
    for (std::size_t k = 0; k < 4; ++k) {
      for (std::size_t y = 0; y < 3; ++y) {
        for (std::size_t l = 0; l < 4; ++l) block[12 * (3 * l + y) + 3 * k + x] -= sums[k][y][l];
      }
    }
  }
}

/// block[12 m + 3 k + x] -= sum over j < count of a[12 j + 4 x + k] motions[4 j + m].
TRACTION_VECTOR_CLONES
void subtractMotions(const double* a, const double* motions, std::size_t count, double* block) {
  Four sums[12] = {}, motion;
  for (std::size_t j = 0; j < count; ++j) {
    __builtin_memcpy(&motion, motions + 4 * j, sizeof motion);
    for (std::size_t e = 0; e < 12; ++e) sums[e] += a[12 * j + e] * motion;
  }
  for (std::size_t e = 0; e < 12; ++e) {
    for (std::size_t m = 0; m < 4; ++m) block[12 * m + 3 * (e % 4) + e / 4] -= sums[e][m];
  }
}

}  // namespace

Stencil::Stencil(const Patch& patch, int columns, int rows) {
  const int column = std::clamp(static_cast<int>(std::floor(patch.column)) - 1, 0, columns - 4);
  const int row = std::clamp(static_cast<int>(std::floor(patch.row)) - 1, 0, rows - 4);
  // A cubic's mean over the patch is its value and half the spread times its second derivative, along either axis.
  const Cubics x = cubics(patch.column - column), y = cubics(patch.row - row);
  const double half = 0.5 * patch.spread;
  for (std::size_t j = 0; j < 4; ++j) {
    const double meanY = y[0][j] + half * y[2][j], slopeY = y[1][j] + half * y[3][j];
    for (std::size_t i = 0; i < 4; ++i) {
      const double meanX = x[0][i] + half * x[2][i], slopeX = x[1][i] + half * x[3][i];
      node[4 * j + i] = (row + static_cast<int>(j)) * columns + column + static_cast<int>(i);
      share[4 * j + i] = {meanX * meanY, slopeX * meanY, meanX * slopeY, 0.5 * (x[2][i] * meanY + meanX * y[2][j])};
    }
  }
}

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

#include "daemon/solve/round_patches.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace tractiond::solve {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

/// Prior of a spread, and the least it may become [pitches^2]. A ball's contact of radius a has a^2 / 5.
constexpr double kSpread = 0.3, kSpreadDeviation = 0.6, kNarrowest = -0.15;
/// A maximum of less pressure than this share of the highest one's is no patch.
constexpr double kFaintest = 0.1;
/// The most steps of a fit, and the farthest that one leads [pitches, pitches^2].
constexpr int kSteps = 16;
constexpr double kFarthest = 0.7, kFarthestSpread = 0.3;
/// Squared deviations below which a gain ends the steps.
constexpr double kLastGain = 0.02;
/// The damping after a step that gained nothing is the former one times kDampingFactor, but at least kDamping.
constexpr double kDamping = 0.1, kMostDamping = 1e4, kDampingFactor = 10.0;
/// Differences of place and spread that derivatives are computed from [pitches, pitches^2].
constexpr double kSmall = 0.02;

/// Element of a place [m, m^2].
double& element(PatchPlace& place, int i) {
  return i == 0 ? place.x_m : i == 1 ? place.y_m : place.spread_m2;
}

}  // namespace

RoundPatches::RoundPatches(const sensor::Sensor& sensor, const Atoms& atoms, const Factors& factors)
    : atoms_(atoms)
    , factors_(factors)
    , influence_(sensor, atoms, factors)
    , spread_(atoms, atoms.pitch_m)
    , force_(atoms.pointCount())
    , height_(atoms.pointCount())
    , motion_(static_cast<std::size_t>(kMotions * influence_.stride()))
    , slopes_(static_cast<std::size_t>(kPatchPlaces * kMost * influence_.stride()))
    , here_(static_cast<std::size_t>(influence_.stride())) {
  for (Fit* fit : {&now_, &next_, &kept_}) {
    fit->columns = LineArray<double>(static_cast<std::size_t>(kPatchLoads * kMost * influence_.stride()));
    fit->left = LineArray<double>(static_cast<std::size_t>(influence_.stride()));
  }
}

const double* RoundPatches::column(const Fit& fit, int number) const {
  return fit.columns.data() + number * std::ptrdiff_t{influence_.stride()};
}

/// Column of an unknown: loads, then motion, then places.
const double* RoundPatches::unknownColumn(int unknown) const {
  if (unknown < loads()) return column(now_, unknown);
  if (unknown < linear()) return motion_.data() + (unknown - loads()) * std::ptrdiff_t{influence_.stride()};
  return slopeColumn(unknown - linear());
}

void RoundPatches::clear(std::span<const int> missing, double* column) const {
  for (const int coordinate : missing) column[coordinate] = 0.0;
}

bool RoundPatches::find(const Displacements& picture, std::span<const double> forces_N) {
  if (!findMaxima(forces_N)) return false;
  takeMotion(picture);
  if (!descend(picture)) return false;
  dropUnlikely(picture);
  const auto found = patches();
  return std::all_of(found.begin(), found.end(), [this](const RoundPatch& patch) {
    return patch.place.spread_m2 < kWidest * square(atoms_.pitch_m);
  });
}

/// Begins with a patch at every maximum of the pressure, but for a single one at the centre of all forces. False: there
/// are none, or too many.
bool RoundPatches::findMaxima(std::span<const double> forces_N) {
  for (Index p = 0; p < force_.size(); ++p) force_[p] = Vector3d::Map(forces_N.data() + 3 * p).norm();
  spread_.average(force_, height_);
  const double highest = height_.maxCoeff();
  count_ = 0;
  if (!(highest > 0.0)) return false;
  const auto isMaximum = [&](int column, int row) {
    const double here = height_[row * atoms_.columns + column];
    if (here < kFaintest * highest) return false;
    for (int r = std::max(row - 1, 0); r <= std::min(row + 1, atoms_.rows - 1); ++r) {
      for (int c = std::max(column - 1, 0); c <= std::min(column + 1, atoms_.columns - 1); ++c) {
        if (height_[r * atoms_.columns + c] > here) return false;
      }
    }
    return true;
  };
  for (int point = 0; point < atoms_.pointCount(); ++point) {
    if (!isMaximum(point % atoms_.columns, point / atoms_.columns)) continue;
    if (count_ == kMost) return false;
    now_.patches[static_cast<std::size_t>(count_++)].place = {atoms_.points(0, point), atoms_.points(1, point), 0.0};
  }
  if (count_ == 1) {
    const Vector3d centre = atoms_.points * force_ / force_.sum();
    now_.patches[0].place = {centre.x(), centre.y(), 0.0};
  }
  for (int k = 0; k < count_; ++k) {
    now_.patches[static_cast<std::size_t>(k)].place.spread_m2 = kSpread * square(atoms_.pitch_m);
  }
  return true;
}

void RoundPatches::takeMotion(const Displacements& picture) {
  for (int m = 0; m < kMotions; ++m) {
    double* const to = motion_.data() + m * std::ptrdiff_t{influence_.stride()};
    std::copy_n(factors_.motion.row(m), factors_.coordinateCount(), to);
    clear(picture.missing, to);
  }
}

/// Gauss-Newton steps, damped where one gains nothing; loads and motion are linear.
bool RoundPatches::descend(const Displacements& picture) {
  if (!solveLoads(picture, now_)) return false;
  differentiate(picture);
  double damping = 0.0;
  Vector step;
  for (int time = 0; time < kSteps; ++time) {
    if (!findStep(damping, step)) return false;
    move(step, next_.patches);
    const bool solved = solveLoads(picture, next_);
    if (!solved || !(next_.misfit <= now_.misfit)) {
      damping = std::max(kDampingFactor * damping, kDamping);
      if (damping > kMostDamping) break;
      continue;
    }
    const double gain = now_.misfit - next_.misfit;
    std::swap(now_, next_);
    differentiate(picture);
    damping = damping > kDamping ? damping / kDampingFactor : 0.0;
    if (gain < kLastGain) break;
  }
  return true;
}

/// Fits again without the least evident patch, as long as that is more likely: the field has maxima of its own where
/// the picture tells little, beyond the nodes for example.
void RoundPatches::dropUnlikely(const Displacements& picture) {
  while (count_ > 1) {
    const double with = logEvidence();
    const int least = leastEvident();
    std::swap(now_, kept_);
    now_.patches = kept_.patches;
    std::copy(kept_.patches.begin() + least + 1, kept_.patches.begin() + count_, now_.patches.begin() + least);
    --count_;
    if (descend(picture) && logEvidence() > with) continue;
    std::swap(now_, kept_);
    ++count_;
    differentiate(picture);
    return;
  }
}

/// Returns the patch whose load is the fewest of its deviations.
int RoundPatches::leastEvident() const {
  const Matrix covariance =
      normal_.selfadjointView<Eigen::Lower>().llt().solve(Matrix::Identity(normal_.rows(), normal_.cols()));
  int least = 0;
  double fewest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < count_; ++k) {
    const PatchLoad& load = now_.patches[static_cast<std::size_t>(k)].load;
    const Eigen::Matrix<double, kPatchLoads, kPatchLoads> own =
        covariance.block<kPatchLoads, kPatchLoads>(kPatchLoads * k, kPatchLoads * k);
    const double squares = load.dot(own.llt().solve(load));
    if (squares < fewest) {
      fewest = squares;
      least = k;
    }
  }
  return least;
}

/// Returns the log evidence of the fit, of a patch anywhere on the nodes, but for what is the same of any number of
/// patches: by Laplace's approximation.
double RoundPatches::logEvidence() const {
  Vector prior = Vector::Ones(normal_.rows());  // deviations
  Vector own = Vector::Ones(normal_.rows());    // what normal_ lacks of their inverse squares
  own.segment<kMotions>(loads()).setZero();
  for (int k = 0; k < count_; ++k) {
    const double force = kFreeLoad * now_.patches[static_cast<std::size_t>(k)].load.head<3>().norm();
    prior.segment<kPatchLoads>(kPatchLoads * k) << force, force, force, atoms_.pitch_m * force;
    prior.segment<kPatchPlaces>(linear() + kPatchPlaces * k) << kFreePlace, kFreePlace, kSpreadDeviation;
    own[linear() + kPatchPlaces * k + 2] = 0.0;
  }
  Matrix ratio = prior.asDiagonal() * normal_ * prior.asDiagonal();
  ratio.diagonal() += own;
  const double logRoot = Eigen::LLT<Matrix>(ratio).matrixLLT().diagonal().array().log().sum();
  return -0.5 * now_.misfit - logRoot - count_ * std::log(atoms_.nodeCount());
}

/// Finds the loads and the motion that explain most with the patches where they are. False: they cannot be told apart.
bool RoundPatches::solveLoads(const Displacements& picture, Fit& fit) {
  const double n2 = square(picture.noise_px);
  const int size = linear(), coordinates = factors_.coordinateCount(), stride = influence_.stride();
  for (int k = 0; k < count_; ++k) {
    double* const columns = fit.columns.data() + std::ptrdiff_t{kPatchLoads} * k * stride;
    influence_.columns(fit.patches[static_cast<std::size_t>(k)].place, columns);
    for (int i = 0; i < kPatchLoads; ++i) clear(picture.missing, columns + std::ptrdiff_t{i} * stride);
  }
  const auto columnOf = [&](int i) {
    return i < loads() ? column(fit, i) : motion_.data() + (i - loads()) * std::ptrdiff_t{stride};
  };
  linear_.resize(size, size);
  linearRight_.resize(size);
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j <= i; ++j) linear_(i, j) = dotProduct(columnOf(i), columnOf(j), coordinates) / n2;
    linearRight_[i] = dotProduct(columnOf(i), picture.displacement_px, coordinates) / n2;
    if (i >= loads()) linear_(i, i) += 1.0;
  }
  const Eigen::LLT<Matrix> factor(linear_);
  if (factor.info() != Eigen::Success) return false;
  const Vector solution = factor.solve(linearRight_);

  double* const left = fit.left.data();
  std::copy_n(picture.displacement_px, coordinates, left);
  for (int i = 0; i < size; ++i) {
    const double* const from = columnOf(i);
    for (int j = 0; j < coordinates; ++j) left[j] -= solution[i] * from[j];
  }
  fit.misfit = dotProduct(left, left, coordinates) / n2;
  for (int k = 0; k < count_; ++k) {
    RoundPatch& patch = fit.patches[static_cast<std::size_t>(k)];
    patch.load = solution.segment<kPatchLoads>(kPatchLoads * k);
    fit.misfit += square((patch.place.spread_m2 / square(atoms_.pitch_m) - kSpread) / kSpreadDeviation);
  }
  for (int m = 0; m < kMotions; ++m) {
    fit.motion[static_cast<std::size_t>(m)] = solution[loads() + m];
    fit.misfit += square(solution[loads() + m]);
  }
  return std::isfinite(fit.misfit);
}

/// Computes the derivatives of the displacements by places and spreads, where the patches are now.
void RoundPatches::differentiate(const Displacements& picture) {
  const int coordinates = factors_.coordinateCount();
  for (int k = 0; k < count_; ++k) {
    const RoundPatch& patch = now_.patches[static_cast<std::size_t>(k)];
    std::fill_n(here_.data(), coordinates, 0.0);
    for (int i = 0; i < kPatchLoads; ++i) {
      const double* const from = column(now_, kPatchLoads * k + i);
      for (int j = 0; j < coordinates; ++j) here_.data()[j] += patch.load[i] * from[j];
    }
    for (int i = 0; i < kPatchPlaces; ++i) {
      const double small = kSmall * (i < 2 ? atoms_.pitch_m : square(atoms_.pitch_m));
      PatchPlace moved = patch.place;
      element(moved, i) += small;
      double* const slope = slopeColumn(kPatchPlaces * k + i);
      influence_.displacement(moved, patch.load, slope);
      for (int j = 0; j < coordinates; ++j) slope[j] = (slope[j] - here_.data()[j]) / small;
      clear(picture.missing, slope);
    }
  }
  // The normal equations of everything; places in pitches, spreads in pitches^2.
  const double n2 = square(picture.noise_px);
  const int size = linear() + kPatchPlaces * count_;
  const auto unit = [this](int unknown) {
    if (unknown < linear()) return 1.0;
    return (unknown - linear()) % kPatchPlaces < 2 ? atoms_.pitch_m : square(atoms_.pitch_m);
  };
  normal_.resize(size, size);
  right_.resize(size);
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j <= i; ++j) {
      normal_(i, j) = unit(i) * unit(j) / n2 * dotProduct(unknownColumn(i), unknownColumn(j), coordinates);
    }
    right_[i] = unit(i) / n2 * dotProduct(unknownColumn(i), now_.left.data(), coordinates);
  }
  for (int m = 0; m < kMotions; ++m) {
    normal_(loads() + m, loads() + m) += 1.0;
    right_[loads() + m] -= now_.motion[static_cast<std::size_t>(m)];
  }
  for (int k = 0; k < count_; ++k) {
    const int i = linear() + kPatchPlaces * k + 2;
    const double spread = now_.patches[static_cast<std::size_t>(k)].place.spread_m2 / square(atoms_.pitch_m);
    normal_(i, i) += 1.0 / square(kSpreadDeviation);
    right_[i] -= (spread - kSpread) / square(kSpreadDeviation);
  }
}

/// Computes a step of the places [pitches, pitches^2]. False: the equations cannot be solved.
bool RoundPatches::findStep(double damping, Vector& step) {
  damped_ = normal_;
  damped_.diagonal().tail(kPatchPlaces * count_) *= 1.0 + damping;
  const Eigen::LLT<Matrix> factor(damped_);
  if (factor.info() != Eigen::Success) return false;
  step = factor.solve(right_);
  return step.allFinite();
}

/// Moves the patches by a step, so far as it is trusted, within the points.
void RoundPatches::move(const Vector& step, std::array<RoundPatch, kMost>& to) const {
  const double pitch = atoms_.pitch_m;
  const auto first = atoms_.points.leftCols<1>(), last = atoms_.points.rightCols<1>();
  for (int k = 0; k < count_; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const double* const change = step.data() + linear() + std::ptrdiff_t{kPatchPlaces} * k;
    const PatchPlace& from = now_.patches[i].place;
    const auto limited = [&](int axis, double most) { return std::clamp(change[axis], -most, most); };
    to[i].place.x_m = std::clamp(from.x_m + pitch * limited(0, kFarthest), first(0), last(0));
    to[i].place.y_m = std::clamp(from.y_m + pitch * limited(1, kFarthest), first(1), last(1));
    to[i].place.spread_m2 = std::clamp(from.spread_m2 + square(pitch) * limited(2, kFarthestSpread),
                                       kNarrowest * square(pitch), kWidest * square(pitch));
  }
}

void RoundPatches::leave(double* left_px, double* still_px) const {
  std::copy_n(now_.left.data(), influence_.stride(), still_px);
  std::copy_n(now_.left.data(), influence_.stride(), left_px);
  for (int m = 0; m < kMotions; ++m) {
    const double* const from = motion_.data() + m * std::ptrdiff_t{influence_.stride()};
    for (int j = 0; j < factors_.coordinateCount(); ++j)
      left_px[j] += now_.motion[static_cast<std::size_t>(m)] * from[j];
  }
}

}  // namespace tractiond::solve

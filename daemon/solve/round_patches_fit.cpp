// The fit of round patches to a picture.
#include "daemon/solve/round_patches.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <limits>

namespace tractiond::solve {
namespace {

/// The least that a spread may become [pitches^2].
constexpr double kNarrowest = -0.15;
/// The most steps of a fit, and the farthest that one leads [pitches, pitches^2].
constexpr int kSteps = 16;
constexpr double kFarthest = 0.7, kFarthestSpread = 0.3;
/// A step that changes the misfit by less than this, either way, is the last one; or by less than this share of what
/// it is above the number of coordinates, as patches that leave so much are not right anyway.
constexpr double kLastGain = 0.02, kLastShare = 1e-3;
/// By so much less in the end, with the slopes of the block: what is found does not depend on the start.
constexpr double kPrecision = 5e-4;
/// Where so many times the expected gain is not enough, none will be.
constexpr double kHope = 3.0;
/// The damping after a step that gained nothing is the former one times kDampingFactor, but at least kDamping.
constexpr double kDamping = 0.1, kMostDamping = 1e4, kDampingFactor = 10.0;
/// Differences of place and spread that derivatives are computed from [pitches, pitches^2].
constexpr double kSmall = 0.02;

/// Along a bar, Gauss's four points in (0, 1) and their weights.
constexpr std::array kBarPlace = {0.0694318442, 0.3300094782, 0.6699905218, 0.9305681558};
constexpr std::array kBarWeight = {0.1739274226, 0.3260725774, 0.3260725774, 0.1739274226};

PatchPlace between(const PatchPlace& from, const PatchPlace& to, double at) {
  return {from.x_m + at * (to.x_m - from.x_m), from.y_m + at * (to.y_m - from.y_m),
          from.spread_m2 + at * (to.spread_m2 - from.spread_m2)};
}

}  // namespace

void RoundPatches::clear(std::span<const int> missing, double* column) const {
  for (const int coordinate : missing) column[coordinate] = 0.0;
}

void RoundPatches::takeMotion(const Displacements& picture) {
  for (int m = 0; m < kMotions; ++m) {
    double* const to = nth(motion_, m);
    std::copy_n(factors_.motion.row(m), factors_.coordinateCount(), to);
    clear(picture.missing, to);
  }
}

/// Gauss-Newton steps, damped where one gains nothing; loads and motion are linear. Ends as soon as the misfit is less
/// than `enough`. False: it could not be solved, or will not be less than `most`.
bool RoundPatches::descend(const Displacements& picture, double most, double enough) {
  if (!solveLoads(picture, now_)) return false;
  differentiate(picture);
  const auto coordinates = static_cast<double>(factors_.coordinateCount() - std::ssize(picture.missing));
  double damping = 0.0;
  Vector step;
  for (int time = 0; time < kSteps && now_.misfit >= enough; ++time) {
    if (!findStep(damping, step)) return false;
    if (damping == 0.0 && now_.misfit - kHope * now_.right.dot(step) > most) return false;
    move(step, next_.patches);
    const bool solved = solveLoads(picture, next_);
    const double gain = now_.misfit - next_.misfit;
    const double last = (isExact_ ? kPrecision : 1.0) * std::max(kLastGain, kLastShare * (now_.misfit - coordinates));
    if (!solved || gain < -last) {
      damping = std::max(kDampingFactor * damping, kDamping);
      if (damping > kMostDamping) break;
      continue;
    }
    std::swap(now_, next_);
    differentiate(picture);
    damping = damping > kDamping ? damping / kDampingFactor : 0.0;
    if (gain < last) break;
  }
  return true;
}

/// Returns the patch whose load is the fewest of its deviations.
int RoundPatches::leastEvident() const {
  const Matrix& normal = now_.normal;
  const Matrix covariance =
      normal.selfadjointView<Eigen::Lower>().llt().solve(Matrix::Identity(normal.rows(), normal.cols()));
  int least = 0;
  double fewest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < count_; ++k) {
    const PatchLoad& load = now_.patches[k].load;
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
  Vector prior = Vector::Ones(now_.normal.rows());  // deviations
  Vector own = Vector::Ones(now_.normal.rows());    // what the equations lack of their inverse squares
  own.segment<kMotions>(loads()).setZero();
  for (int k = 0; k < count_; ++k) {
    const double force = kFreeLoad * now_.patches[k].load.head<3>().norm();
    prior.segment<kPatchLoads>(kPatchLoads * k) << force, force, force, atoms_.pitch_m * force;
    prior.segment<kPatchPlaces>(linear() + kPatchPlaces * k) << kFreePlace, kFreePlace, kSpreadDeviation;
    own[linear() + kPatchPlaces * k + 2] = 0.0;
  }
  Matrix ratio = prior.asDiagonal() * now_.normal * prior.asDiagonal();
  ratio.diagonal() += own;
  const double logRoot = Eigen::LLT<Matrix>(ratio).matrixLLT().diagonal().array().log().sum();
  return -0.5 * now_.misfit - logRoot - count_ * std::log(atoms_.nodeCount());
}

/// Returns the misfit above which so many patches cannot be as likely as that.
double RoundPatches::mostMisfit(double logEvidence) const {
  return -2.0 * (logEvidence + count_ * std::log(atoms_.nodeCount()));
}

/// Computes what the patches do to the markers that are there.
void RoundPatches::layColumns(const Displacements& picture, Fit& fit) {
  for (int k = 0; k < count_; ++k) {
    if (!isEnd(k)) influence_.columns(fit.patches[k].place, nth(fit.columns, kPatchLoads * k));
  }
  if (bar_[0] >= 0) layBar(fit);
  for (int i = 0; i < loads(); ++i) clear(picture.missing, nth(fit.columns, i));
}

void RoundPatches::layBar(Fit& fit) {
  const auto [from, to] = bar_;
  const std::ptrdiff_t size = std::ptrdiff_t{kPatchLoads} * influence_.stride();
  double *const first = nth(fit.columns, kPatchLoads * from), *const last = nth(fit.columns, kPatchLoads * to);
  std::fill_n(first, size, 0.0);
  std::fill_n(last, size, 0.0);
  for (std::size_t i = 0; i < kBarPlace.size(); ++i) {
    influence_.columns(between(fit.patches[from].place, fit.patches[to].place, kBarPlace[i]), spot_.data());
    const double share = 2.0 * kBarWeight[i] * (1.0 - kBarPlace[i]), other = 2.0 * kBarWeight[i] * kBarPlace[i];
    for (std::ptrdiff_t j = 0; j < size; ++j) {
      first[j] += share * spot_.data()[j];
      last[j] += other * spot_.data()[j];
    }
  }
}

/// Finds the loads and the motion that explain most with the patches where they are. False: they cannot be told apart.
bool RoundPatches::solveLoads(const Displacements& picture, Fit& fit) {
  const double n2 = square(picture.noise_px);
  const int size = linear(), coordinates = factors_.coordinateCount(), stride = influence_.stride();
  layColumns(picture, fit);
  // Loads, motion, the picture.
  std::array<const double*, kMostLinear + 1> columns{};
  for (int i = 0; i < loads(); ++i) columns[i] = nth(fit.columns, i);
  for (int m = 0; m < kMotions; ++m) columns[loads() + m] = nth(motion_, m);
  columns[size] = picture.displacement_px;
  std::array<double, (kMostLinear + 1) * (kMostLinear + 1)> products;
  multiplyPairs({columns.data(), static_cast<std::size_t>(size) + 1}, 0, stride, products.data(), size + 1);
  fit.linear.resize(size, size);
  Vector right(size);
  for (int i = 0; i < size; ++i) {
    const auto product = [&](int a, int b) { return products[(size + 1) * a + b] / n2; };
    for (int j = 0; j <= i; ++j) fit.linear(i, j) = product(i, j);
    right[i] = product(size, i);
    if (i >= loads()) fit.linear(i, i) += 1.0;
  }
  const Eigen::LLT<Matrix> factor(fit.linear);
  if (factor.info() != Eigen::Success) return false;
  const Vector solution = factor.solve(right);

  double* const left = fit.left.data();
  std::copy_n(picture.displacement_px, coordinates, left);
  for (int i = 0; i < size; ++i) {
    const double* const from = columns[i];
    for (int j = 0; j < coordinates; ++j) left[j] -= solution[i] * from[j];
  }
  fit.misfit = dotProduct(left, left, coordinates) / n2;
  for (int k = 0; k < count_; ++k) {
    RoundPatch& patch = fit.patches[k];
    patch.load = solution.segment<kPatchLoads>(kPatchLoads * k);
    fit.misfit += square((patch.place.spread_m2 / square(atoms_.pitch_m) - kSpread) / kSpreadDeviation);
  }
  for (int m = 0; m < kMotions; ++m) {
    fit.motion[m] = solution[loads() + m];
    fit.misfit += square(solution[loads() + m]);
  }
  return std::isfinite(fit.misfit);
}

/// Computes the derivatives of the displacements by places and spreads, where the patches are now.
void RoundPatches::laySlopes(const Displacements& picture) {
  for (int k = 0; k < count_; ++k) {
    if (!isEnd(k)) differentiateRound(k);
  }
  if (bar_[0] >= 0) differentiateBar();
  for (int i = 0; i < kPatchPlaces * count_; ++i) clear(picture.missing, nth(now_.slopes, i));
}

bool RoundPatches::linearise(const Displacements& picture) {
  isExact_ = true;
  const bool isDone = descend(picture);
  isExact_ = false;
  return isDone;
}

/// Computes the equations of a step: loads and motion, which are at their best, have nothing on the right.
void RoundPatches::differentiate(const Displacements& picture) {
  laySlopes(picture);
  // Loads, motion, what is left, the places.
  const int places = kPatchPlaces * count_, size = linear() + places, left = linear(), stride = size + 1;
  std::array<const double*, kMostUnknowns + 1> columns{};
  for (int i = 0; i < loads(); ++i) columns[i] = nth(now_.columns, i);
  for (int m = 0; m < kMotions; ++m) columns[loads() + m] = nth(motion_, m);
  columns[left] = now_.left.data();
  for (int i = 0; i < places; ++i) columns[left + 1 + i] = nth(now_.slopes, i);
  std::array<double, (kMostUnknowns + 1) * (kMostUnknowns + 1)> products;
  multiplyPairs({columns.data(), static_cast<std::size_t>(stride)}, left + 1, influence_.stride(), products.data(),
                stride);
  // Places in pitches, spreads in pitches^2.
  const double n2 = square(picture.noise_px);
  now_.normal.resize(size, size);
  now_.normal.topLeftCorner(linear(), linear()) = now_.linear;
  now_.right.setZero(size);
  for (int i = 0; i < places; ++i) {
    const double* const row = products.data() + static_cast<std::ptrdiff_t>(left + 1 + i) * stride;
    const double unit = unitOf(i % kPatchPlaces) / n2;
    for (int j = 0; j < linear(); ++j) now_.normal(linear() + i, j) = unit * row[j];
    for (int j = 0; j <= i; ++j) {
      now_.normal(linear() + i, linear() + j) = unit * unitOf(j % kPatchPlaces) * row[left + 1 + j];
    }
    now_.right[linear() + i] = unit * row[left];
  }
  for (int k = 0; k < count_; ++k) {
    const int i = linear() + kPatchPlaces * k + 2;
    const double spread = now_.patches[k].place.spread_m2 / square(atoms_.pitch_m);
    now_.normal(i, i) += 1.0 / square(kSpreadDeviation);
    now_.right[i] -= (spread - kSpread) / square(kSpreadDeviation);
  }
}

/// Unit of an element of a place [m, m^2].
double RoundPatches::unitOf(int place) const {
  return place < 2 ? atoms_.pitch_m : square(atoms_.pitch_m);
}

/// Computes the displacements by a patch, of which slopes are differences.
void RoundPatches::displacement(const RoundPatch& patch, double* column) {
  if (isExact_) {
    influence_.displacement(patch.place, patch.load, column);
  } else {
    influence_.halfSpace(patch.place, patch.load, column);
  }
}

/// Computes by how much more a patch displaces than here_ says if an element of its place is larger, for a unit of it.
void RoundPatches::differentiatePlace(RoundPatch patch, int i, double* slope) {
  const double small = kSmall * unitOf(i);
  element(patch.place, i) += small;
  displacement(patch, slope);
  for (int j = 0; j < factors_.coordinateCount(); ++j) slope[j] = (slope[j] - here_.data()[j]) / small;
}

void RoundPatches::differentiateRound(int patch) {
  const RoundPatch& here = now_.patches[patch];
  displacement(here, here_.data());
  for (int i = 0; i < kPatchPlaces; ++i) differentiatePlace(here, i, nth(now_.slopes, kPatchPlaces * patch + i));
}

/// A point of a bar moves as its ends do, each by the share that it has in the point's place.
void RoundPatches::differentiateBar() {
  const int coordinates = factors_.coordinateCount();
  const std::ptrdiff_t size = kPatchPlaces * std::ptrdiff_t{influence_.stride()};
  for (const int end : bar_) std::fill_n(nth(now_.slopes, kPatchPlaces * end), size, 0.0);
  const RoundPatch &from = now_.patches[bar_[0]], &to = now_.patches[bar_[1]];
  for (std::size_t s = 0; s < kBarPlace.size(); ++s) {
    const double weight = 2.0 * kBarWeight[s], ofTo = kBarPlace[s], ofFrom = 1.0 - ofTo;
    const RoundPatch spot{between(from.place, to.place, ofTo), weight * (ofFrom * from.load + ofTo * to.load)};
    displacement(spot, here_.data());
    for (int i = 0; i < kPatchPlaces; ++i) {
      differentiatePlace(spot, i, spot_.data());
      double *const first = nth(now_.slopes, kPatchPlaces * bar_[0] + i), *const last = nth(now_.slopes,
                                                                                            kPatchPlaces * bar_[1] + i);
      for (int j = 0; j < coordinates; ++j) {
        first[j] += ofFrom * spot_.data()[j];
        last[j] += ofTo * spot_.data()[j];
      }
    }
  }
}

void RoundPatches::shearSlope(int patch, int axis, double* column) const {
  // Mindlin's shear lacks that of a ball's contact of the radius of the area that sticks: the difference is exact where
  // this is kStick of the whole radius.
  constexpr double kStick = 0.67;
  PatchPlace place = now_.patches[patch].place;
  const double step = (1.0 - square(kStick)) * place.spread_m2;
  LineArray<double> inside(influence_.stride());
  influence_.halfSpace(place, PatchLoad::Unit(axis), column);
  place.spread_m2 -= step;
  influence_.halfSpace(place, PatchLoad::Unit(axis), inside.data());
  for (int j = 0; j < influence_.stride(); ++j) column[j] = step > 0.0 ? (column[j] - inside.data()[j]) / step : 0.0;
}

void RoundPatches::curves(int patch, double* columns) const {
  // Differences over half a pitch and a whole one, of a half-space: what the block adds is smooth.
  constexpr double kApart = 0.5;
  const std::ptrdiff_t size = influence_.stride();
  const RoundPatch& here = now_.patches[patch];
  std::fill_n(columns, kPowers * size, 0.0);
  LineArray<double> shifted(size);
  const auto add = [&](int x, int y, const std::array<double, kPowers>& factors) {
    PatchPlace place = here.place;
    place.x_m += kApart * x * atoms_.pitch_m;
    place.y_m += kApart * y * atoms_.pitch_m;
    influence_.halfSpace(place, here.load, shifted.data());
    for (std::size_t k = 0; k < factors.size(); ++k) {
      const double factor = factors[k] / std::pow(kApart, k < 3 ? 2.0 : 3.0);
      double* const to = columns + static_cast<std::ptrdiff_t>(k) * size;
      for (std::ptrdiff_t j = 0; factor != 0.0 && j < size; ++j) to[j] += factor * shifted.data()[j];
    }
  };
  add(0, 0, {-1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0});
  for (const int sign : {-1, 1}) {
    add(sign, 0, {0.5, 0.0, 0.0, -sign / 6.0, 0.0, -0.5 * sign, 0.0});
    add(0, sign, {0.0, 0.0, 0.5, 0.0, -0.5 * sign, 0.0, -sign / 6.0});
    add(2 * sign, 0, {0.0, 0.0, 0.0, sign / 12.0, 0.0, 0.0, 0.0});
    add(0, 2 * sign, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, sign / 12.0});
    for (const int other : {-1, 1})
      add(sign, other, {0.0, 0.25 * sign * other, 0.0, 0.0, 0.25 * other, 0.25 * sign, 0.0});
  }
}

/// Computes a step of the places [pitches, pitches^2]. False: the equations cannot be solved.
bool RoundPatches::findStep(double damping, Vector& step) {
  damped_ = now_.normal;
  damped_.diagonal().tail(kPatchPlaces * count_) *= 1.0 + damping;
  right_ = now_.right;
  do {
    const Eigen::LLT<Matrix> factor(damped_);
    if (factor.info() != Eigen::Success) return false;
    step = factor.solve(right_);
  } while (holdsAtWidest(step));
  return step.allFinite();
}

/// Takes the spreads that are at their largest out of the equations if the step would lead farther. Returns whether
/// there were any.
bool RoundPatches::holdsAtWidest(const Vector& step) {
  bool holds = false;
  for (int k = 0; k < count_; ++k) {
    const int i = linear() + kPatchPlaces * k + 2;
    const bool isWidest = now_.patches[k].place.spread_m2 >= kWidest * square(atoms_.pitch_m);
    if (!isWidest || !(step[i] > 0.0)) continue;  // nor if it is not finite
    damped_.row(i).setZero();
    damped_.col(i).setZero();
    damped_(i, i) = 1.0;
    right_[i] = 0.0;
    holds = true;
  }
  return holds;
}

/// Moves the patches by a step, so far as it is trusted, within the points.
void RoundPatches::move(const Vector& step, std::array<RoundPatch, kMost>& to) const {
  const double pitch = atoms_.pitch_m;
  const auto first = atoms_.points.leftCols<1>(), last = atoms_.points.rightCols<1>();
  for (int k = 0; k < count_; ++k) {
    const double* const change = step.data() + linear() + kPatchPlaces * k;
    const PatchPlace& from = now_.patches[k].place;
    const auto limited = [&](int axis, double most) { return std::clamp(change[axis], -most, most); };
    to[k].place.x_m = std::clamp(from.x_m + pitch * limited(0, kFarthest), first(0), last(0));
    to[k].place.y_m = std::clamp(from.y_m + pitch * limited(1, kFarthest), first(1), last(1));
    to[k].place.spread_m2 = std::clamp(from.spread_m2 + square(pitch) * limited(2, kFarthestSpread),
                                       kNarrowest * square(pitch), kWidest * square(pitch));
  }
}

void RoundPatches::leave(double* left_px, double* still_px) const {
  std::copy_n(now_.left.data(), influence_.stride(), still_px);
  std::copy_n(now_.left.data(), influence_.stride(), left_px);
  for (int m = 0; m < kMotions; ++m) {
    const double* const from = nth(motion_, m);
    for (int j = 0; j < factors_.coordinateCount(); ++j) left_px[j] += now_.motion[m] * from[j];
  }
}

}  // namespace tractiond::solve

#include "daemon/solve/modes.h"

#include "sensor/elastic/linear_algebra.h"

#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

namespace tractiond::solve {
namespace {

using Eigen::Index;

/// tau is one of exp(kFirst), exp(kFirst + kStep) .. times Factors::force_N, from far below the detection limit to far
/// above what a gel bears.
constexpr double kFirst = -12.0, kStep = 0.25;
constexpr int kRatios = 51;

/// Variance that is added along all axes, as a share of their sum, so that a covariance has an inverse.
constexpr double kSingular = 1e-9;

/// Times that missing displacements are completed: the first time the missing ones themselves pass for forces.
constexpr int kCompletions = 2;

/// Share of the atoms that are as good as independent where few pictures of noise reach the threshold.
constexpr double kIndependent = 0.25;

/// Returns the probability that chi of three degrees of freedom exceeds `deviations`.
double exceeding(double deviations) {
  return std::erfc(deviations / std::numbers::sqrt2) +
         std::sqrt(2.0 / std::numbers::pi) * deviations * std::exp(-0.5 * square(deviations));
}

/// Returns the inverse of a covariance; 0 if the covariance is 0.
Block inverseOf(const Block& covariance) {
  const double trace = covariance.trace();
  if (!(trace > 0.0)) return Block::Zero();
  return (covariance + kSingular * trace * Block::Identity()).inverse();
}

}  // namespace

double detectionThreshold(double falseAlarms, int atoms) {
  if (falseAlarms >= 1.0) return 0.0;
  const double share = falseAlarms / (kIndependent * atoms);
  double low = 0.0, high = 30.0;  // beyond which exceeding() is 0
  for (int halving = 0; halving < 50; ++halving) {
    const double middle = 0.5 * (low + high);
    (exceeding(middle) > share ? low : high) = middle;
  }
  return low;
}

void makeEvident(const BestForce& force, AtomMoments& moments) {
  Eigen::Vector3d::Map(moments.mean_N.data() + 3 * static_cast<Index>(force.atom)) = force.force_N;
  moments.noise_N2[force.atom] = 0.0;
}

Modes::Modes(const Factors& factors, const Atoms& atoms, const SolveOptions& options)
    : factors_(factors)
    , atoms_(atoms)
    , detection_(detectionThreshold(options.falseAlarms(), atoms.count()))
    , strong_(std::make_shared<const StrongModes>(factors, atoms, options.noise_px))
    , amplitudes_(factors, strong_)
    , matched_(3 * atoms.count())
    , everyPoint_(every(factors.right.rows()))
    , power_(factors.rank())
    , left_(factors.rank())
    , filtered_(factors.right.stride())
    , pointMean_(everyPoint_.size())
    , coefficients_(everyPoint_.size()) {
  Tables tables;
  const int rank = factors.rank();
  for (const double least : ModelConstants::kGroups) {
    const int count = modesAbove(least, factors, options.noise_px);
    if (count > (tables.ends.empty() ? 0 : tables.ends.back()) && count < rank) tables.ends.push_back(count);
  }
  tables.ends.push_back(rank);
  assert(tables.ends.front() == strong_->count);
  tables.unexplained.resize(rank, kRatios);
  tables.logarithms.resize(rank, kRatios);
  const Eigen::ArrayXd s2 = Eigen::ArrayXd::Map(factors.singularValues.data(), rank).square();
  for (int i = 0; i < kRatios; ++i) {
    const double ratio = factors.force_N * std::exp(kFirst + kStep * i) / options.noise_px;
    const Eigen::ArrayXd total = s2 * ratio * ratio + 1.0;
    tables.ratios.push_back(ratio);
    const Eigen::ArrayXd logarithms = total.log();
    std::partial_sum(logarithms.begin(), logarithms.end(), tables.logarithms.col(i).data());
    tables.unexplained.col(i) = total.inverse();
    tables.used.push_back(tables.ends[lastVisible(factors, tables, ratio)]);
  }
  tabulate(factors, atoms, tables);
  tables.motionOf = (factors.motionGram + square(options.noise_px) * Eigen::Matrix4d::Identity()).inverse();
  tables_ = std::make_shared<const Tables>(std::move(tables));
}

/// Computes what depends on the ratio and the atom.
void Modes::tabulate(const Factors& factors, const Atoms& atoms, Tables& tables) {
  const int rank = factors.rank(), strong = tables.ends.front();
  const Eigen::ArrayXd s2 = Eigen::ArrayXd::Map(factors.singularValues.data(), rank).square();
  // Weights of the modes: of known, of the noise of each ratio, and of tables.alone.
  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(rank, 2 * kRatios + 1);
  for (int i = 0; i < kRatios; ++i) {
    const int used = tables.used[i];
    const Eigen::ArrayXd gain = 1.0 - tables.unexplained.col(i).head(used).array();
    weights.col(i).head(used) = gain;
    weights.col(kRatios + i).head(used) = gain.square() / s2.head(used);
  }
  weights.col(2 * kRatios).head(strong) = s2.head(strong);
  tables.known.resize(atoms.count(), kRatios);
  tables.precision.assign(kRatios, std::vector<Block>(atoms.count()));
  constexpr Index kTogether = 64, kProducts = 6;  // atoms; products of the components of an atom's row of V
  Eigen::MatrixXd row(3, rank), products = Eigen::MatrixXd::Zero(rank, kProducts * kTogether);
  Eigen::MatrixXd sums(products.cols(), weights.cols());
  for (int a = 0; a < atoms.count(); ++a) {
    const Index first = kProducts * (a % kTogether);
    if (first == 0) {
      for (Index i = 0; i < std::min(kTogether, Index{atoms.count()} - a); ++i) {
        modesOfAtom(factors, atoms, static_cast<int>(a + i), row);
        for (int r = 0, at = 0; r < 3; ++r) {
          for (int c = 0; c <= r; ++c) products.col(kProducts * i + at++) = row.row(r).cwiseProduct(row.row(c));
        }
      }
      sensor::elastic::multiply(1.0, products, sensor::elastic::Op::kTransposed, weights, sensor::elastic::Op::kPlain,
                                0.0, sums);
    }
    const auto block = [&](int i) {
      Block sum;
      for (int r = 0, at = 0; r < 3; ++r) {
        for (int c = 0; c <= r; ++c) sum(r, c) = sum(c, r) = sums(first + at++, i);
      }
      return sum;
    };
    for (int i = 0; i < kRatios; ++i) {
      tables.known(a, i) = block(i).trace();
      tables.precision[i][a] = inverseOf(block(kRatios + i));
    }
    tables.alone.push_back(inverseOf(block(2 * kRatios)));
  }
}

/// Returns the last group of modes in which forces of that size are visible.
int Modes::lastVisible(const Factors& factors, const Tables& tables, double ratio) {
  std::size_t group = 0;
  const auto isVisible = [&](int mode) { return factors.singularValues[mode] * ratio >= ModelConstants::kVisible; };
  while (group + 1 < tables.ends.size() && isVisible(tables.ends[group])) ++group;
  return static_cast<int>(group);
}

const BestForce& Modes::look(const Displacements& picture) {
  noise_px_ = picture.noise_px;
  isMissing_ = !picture.missing.empty();
  amplitudes_.begin(picture.rounded_px, picture.missing);
  readMore(0.0);
  complete();
  return best_ = bestOf(amplitudes_.values());
}

bool Modes::detect(const Displacements& picture, std::span<const float> variance_px2) {
  look(picture);
  confirm(variance_px2);
  return best_.squaredDeviations >= square(detection_);
}

void Modes::start(AtomMoments& moments) {
  const double least_N = leastTypical_N(best_);
  while (readMore(least_N)) {
    while (readMore(least_N)) {
    }
    complete();
  }
  startWith(amplitudes_.values(), best_, moments);
}

bool Modes::startBeside(std::span<const double> forces_N, AtomMoments& moments) {
  const auto amplitudes = amplitudes_.values();
  const auto modes = static_cast<int>(amplitudes.size());
  for (std::size_t i = 0; i < coefficients_.size(); ++i) coefficients_[i] = static_cast<float>(forces_N[i]);
  std::fill_n(filtered_.data(), filtered_.size(), 0.0);
  addColumns(right(modes), everyPoint_, coefficients_, 0, modes, filtered_.data());
  for (int k = 0; k < modes; ++k) left_[k] = amplitudes[k] - factors_.singularValues[k] * filtered_.data()[k];
  const auto left = std::span(left_).first(modes);
  const BestForce best = bestOf(left);
  if (best.squaredDeviations < square(ModelConstants::kSignificance)) return false;
  startWith(left, best, moments);
  return true;
}

/// Reads the modes of the first group, or those of one more if they are needed. Returns whether they are.
bool Modes::readMore(double least_N) {
  const auto amplitudes = amplitudes_.values();
  const auto count = static_cast<int>(amplitudes.size());
  if (count > 0 && tables_->used[likeliest(amplitudes, least_N)] <= count) return false;
  amplitudes_.read(*std::upper_bound(tables_->ends.begin(), tables_->ends.end(), count));
  return true;
}

/// Completes what is missing.
void Modes::complete() {
  for (int i = 0; i < kCompletions && isMissing_; ++i) {
    amplitudes_.complete(tables_->ratios[likeliest(amplitudes_.values(), 0.0)] * noise_px_, noise_px_);
  }
}

/// Returns the index of the likeliest tau, at least of `least_N`.
int Modes::likeliest(std::span<const double> amplitudes, double least_N) {
  const auto count = static_cast<int>(amplitudes.size()), rank = factors_.rank();
  assert(count > 0 && count <= rank);
  for (int k = 0; k < count; ++k) power_[k] = square(amplitudes[k]);
  int best = 0;
  double least = 0.0;  // -2 times the evidence, but for the modes' ln n^2
  for (int i = 0; i < kRatios; ++i) {
    const double* const share = tables_->unexplained.data() + static_cast<std::ptrdiff_t>(i) * rank;
    const double unlikely =
        tables_->logarithms(count - 1, i) + dotProduct(power_.data(), share, count) / square(noise_px_);
    if (i == 0 || unlikely < least) {
      best = i;
      least = unlikely;
    }
  }
  while (best + 1 < kRatios && tables_->ratios[best] * noise_px_ < least_N) ++best;
  return best;
}

/// Finds the most significant force, by the modes of the first group.
BestForce Modes::bestOf(std::span<const double> amplitudes) {
  const int used = tables_->ends.front();
  assert(std::ssize(amplitudes) >= used);
  for (int k = 0; k < used; ++k) filtered_.data()[k] = factors_.singularValues[k] * amplitudes[k];
  addUpModes(used, matched_);
  BestForce best;
  for (int a = 0; a < atoms_.count(); ++a) {
    const BestForce alone = aloneWith(a);
    if (alone.squaredDeviations > best.squaredDeviations) best = alone;
  }
  return best;
}

/// Replaces the most significant force, if it is sure enough, by the one that is most significant by the noise of the
/// markers that show it.
void Modes::confirm(std::span<const float> variance_px2) {
  BestForce& found = best_;
  if (found.squaredDeviations < square(detection_) || variance_px2.empty()) return;
  // That of a touch passes at once; the others are asked where it does not.
  found.squaredDeviations /= noiseWhereShown(found, variance_px2);
  for (int a = 0; a < atoms_.count() && found.squaredDeviations < square(detection_); ++a) {
    BestForce alone = aloneWith(a);
    if (alone.squaredDeviations < square(detection_)) continue;
    alone.squaredDeviations /= noiseWhereShown(alone, variance_px2);
    if (alone.squaredDeviations > found.squaredDeviations) found = alone;
  }
}

/// Returns the force of one atom that explains most, by matched_.
BestForce Modes::aloneWith(int atom) const {
  const auto matched = Eigen::Vector3d::Map(matched_.data() + 3 * static_cast<Index>(atom));
  const Eigen::Vector3d force = tables_->alone[atom] * matched;
  return {matched.dot(force) / square(noise_px_), atom, force};
}

/// Returns the mean of the markers' variances, weighted by the squared displacements that the force causes beside
/// motion of the picture, over their plain mean; 1 if there is none.
double Modes::noiseWhereShown(const BestForce& force, std::span<const float> variance_px2) const {
  const Index first = 3 * static_cast<Index>(force.atom);
  const Eigen::Vector4d motion = tables_->motionOf * (factors_.motionCoupling.middleCols<3>(first) * force.force_N);
  const std::array<const float*, 3> influence = {factors_.influence.row(3 * force.atom),
                                                 factors_.influence.row(3 * force.atom + 1),
                                                 factors_.influence.row(3 * force.atom + 2)};
  double shown = 0.0, all = 0.0, squares = 0.0;
  int count = 0;
  for (std::size_t marker = 0; marker < variance_px2.size(); ++marker) {
    const double variance = static_cast<double>(variance_px2[marker]);
    if (!(variance > 0.0)) continue;
    for (const std::size_t i : {2 * marker, 2 * marker + 1}) {
      double caused = 0.0;
      for (int c = 0; c < 3; ++c) caused += force.force_N[c] * static_cast<double>(influence[c][i]);
      for (int k = 0; k < kMotions; ++k) caused -= motion[k] * static_cast<double>(factors_.motion.row(k)[i]);
      shown += variance * square(caused);
      squares += square(caused);
    }
    all += variance;
    ++count;
  }
  return squares > 0.0 ? shown / squares * count / all : 1.0;
}

/// Returns the least typical force of a picture that shows this one [N].
double Modes::leastTypical_N(const BestForce& force) const {
  return force.force_N.norm() / std::sqrt(static_cast<double>(everyPoint_.size()));
}

/// V of the points, with that many of its first modes at least.
const RowMatrix& Modes::right(int modes) const {
  return modes <= strong_->count ? strong_->right : factors_.right;
}

/// Multiplies the rows of V of all atoms (3A) by the first `used` elements of filtered_.
void Modes::addUpModes(int used, std::vector<double>& sums) {
  std::fill_n(filtered_.data() + used, padded(used) - used, 0.0);
  multiplyFirst(right(used), everyPoint_, used, filtered_.data(), pointMean_.data());
  for (int a = 0; a < atoms_.count(); ++a) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (Eigen::SparseMatrix<double>::InnerIterator it(atoms_.shape, a); it; ++it) {
      sum += it.value() * Eigen::Vector3d::Map(pointMean_.data() + 3 * it.row());
    }
    Eigen::Vector3d::Map(sums.data() + 3 * static_cast<Index>(a)) = sum;
  }
}

/// Computes the moments of all atoms from amplitudes, of which as many are read as are needed.
void Modes::startWith(std::span<const double> amplitudes, const BestForce& force, AtomMoments& moments) {
  const int best = likeliest(amplitudes, leastTypical_N(force)),
            used = std::min(tables_->used[best], static_cast<int>(amplitudes.size()));
  for (int k = 0; k < used; ++k) {
    filtered_.data()[k] = (1.0 - tables_->unexplained(k, best)) / factors_.singularValues[k] * amplitudes[k];
  }
  addUpModes(used, moments.mean_N);
  for (int a = 0; a < atoms_.count(); ++a) {
    moments.known[a] = tables_->known(a, best);
    const auto mean = Eigen::Vector3d::Map(moments.mean_N.data() + 3 * static_cast<Index>(a));
    const double precision = mean.dot(tables_->precision[best][a] * mean);
    moments.noise_N2[a] = precision > 0.0 ? 3.0 * square(noise_px_) * mean.squaredNorm() / precision : 0.0;
  }
  const bool isSure = force.squaredDeviations >= square(ModelConstants::kBroad);
  if (isSure && atoms_.isAmbiguous(force.atom)) makeEvident(force, moments);
}

}  // namespace tractiond::solve

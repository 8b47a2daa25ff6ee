#include "daemon/solve/model_solver.h"

#include "base/quantile.h"
#include "daemon/solve/mechanics_noise.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace tractiond::solve {
namespace {

// Forces that detectionLimit() tries first, as shares of Factors::force_N: kFirst, then doubled so many times.
constexpr double kFirst = 5e-4;
constexpr int kDoublings = 15;
static_assert(kFirst * (1 << kDoublings) == kLargestDetectable);

/// A model is to be renewed after so many frames, or if a patch has moved so far [pitches], the prior has grown or the
/// force has shrunk so much, or the most significant force that is left has so many deviations: well before it no
/// longer holds, or while what has gone leaves more room than it should.
constexpr std::uint64_t kFresh = 3;
constexpr double kNear = 0.15, kGrown = 1.1, kSure = 4.5;

/// Models that exist: one that answers, one that waits to, one that is being made.
constexpr int kModels = 3;

}  // namespace

ModelSolver::ModelSolver(const Factors& factors, const Atoms& atoms, const sensor::Sensor& sensor,
                         const SolveOptions& options, const std::optional<std::array<double, 2>>& detectionLimit_N)
    : factors_(factors)
    , atoms_(atoms)
    , noise_px_(options.noise_px)
    , model_(sensor, factors, atoms, options)
    , modes_(model_.modes())
    , detectionLimit_N_(detectionLimit_N ? *detectionLimit_N : detectionLimits(sensor))
    , writer_(factors, atoms, sensor, options, detectionLimit_N_)
    , answerWriter_(factors, atoms, sensor, options, detectionLimit_N_)
    , noProducts_(factors, 1)
    , motionAlone_(factors, atoms, 1)
    , empty_(atoms, 1) {
  for (Estimate* each : {&estimate_, &answer_}) each->force_N.resize(3 * atoms.pointCount());
  for (int i = 0; i < kModels; ++i) {
    learnt_.push_back(std::make_shared<Learnt>(Learnt{LinearModel(factors, atoms, modes_.strong()), {}}));
  }
}

void ModelSolver::solve(const MarkerField& markers, TractionField& field) noexcept {
  solved_ = {markers.info, markers.zero};
  estimate_.outcome = Estimate::Outcome::kFailed;
  if (!writer_.begin(markers, field)) return;
  model_.solve(writer_.picture(), estimate_, writer_.used().variance_px2());
  writer_.write(estimate_, model_.mixture(), field);
  if (field.valid) field.solution = Solution::kFull;
}

bool ModelSolver::learn() {
  if (estimate_.outcome != Estimate::Outcome::kFound) return false;
  const auto isSpare = [](const auto& each) { return each.use_count() == 1; };
  const auto spare = std::find_if(learnt_.begin(), learnt_.end(), isSpare);
  if (spare == learnt_.end() || !(*spare)->model.make(model_, estimate_, scratch_)) return false;
  (*spare)->of = solved_;
  return newest_.put(*spare);
}

bool ModelSolver::answer(const MarkerField& markers, TractionField& field) noexcept {
  wantsModel_ = true;
  if (!answerWriter_.begin(markers, field)) return true;
  const Displacements picture = answerWriter_.picture();
  if (!std::isfinite(picture.squares_px2)) return false;
  if (!modes_.detect(picture, answerWriter_.used().variance_px2())) {
    answerNothing(picture, field);
    return true;
  }
  newest_.swap(inForce_);
  if (!inForce_ || !inForce_->of.isInForce(markers)) return false;
  if (!inForce_->model.answer(picture, modes_, answer_)) return false;
  answerWriter_.write(answer_, inForce_->model.mixture(), field);
  if (!field.valid) return false;
  field.solution = Solution::kLinear;
  field.modelFrame = inForce_->of.info.frameNumber;
  const LinearModel::Doubt& doubt = inForce_->model.doubt();
  wantsModel_ = markers.info.frameNumber - field.modelFrame >= kFresh || doubt.shift > kNear || doubt.scale > kGrown ||
                doubt.force < 1.0 / kGrown || doubt.significance > kSure;
  return true;
}

/// Completes a field in which nothing touches, as solve() does.
void ModelSolver::answerNothing(const Displacements& picture, TractionField& field) {
  Model::clear(answer_);
  noProducts_.begin(picture);
  explainByMotion(picture, noProducts_, motionAlone_, answer_);
  answerWriter_.write(answer_, empty_, field);
  if (field.valid) field.solution = Solution::kFull;
}

std::array<double, 2> ModelSolver::detectionLimits(const sensor::Sensor& sensor) {
  const double error = std::hypot(factors_.systematicErrors.displacement, sensor.uncertainty.model);
  return {detectionLimit(0, error), detectionLimit(2, error)};
}

/// Looks at pictures of a force on each of nine points, raised until something is found and then halved in between.
double ModelSolver::detectionLimit(int axis, double error) {
  constexpr int kHalvings = 5;
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal(0.0, noise_px_);
  std::vector<double> limits;
  std::vector<double> noise(factors_.coordinateCount());
  std::vector<float> picture(noise.size());
  std::vector<double> exactly(factors_.influence.stride());
  for (const int point : nineOf(atoms_.points, atoms_.columns, atoms_.rows)) {
    const float* const unit = factors_.influence.row(3 * point + axis);
    for (double& each : noise) each = normal(generator);
    const auto finds = [&](double force_N) {
      for (std::size_t k = 0; k < noise.size(); ++k) picture[k] = static_cast<float>(force_N * unit[k] + noise[k]);
      std::copy(picture.begin(), picture.end(), exactly.begin());
      const double noise_px = noiseWithMechanics_px(std::span<const float>(picture), noise_px_, error);
      const double squares = dotProduct(exactly.data(), exactly.data(), factors_.coordinateCount());
      return modes_.detect({exactly.data(), {}, squares, noise_px, picture}, {});
    };
    double high = kFirst * factors_.force_N;
    bool isFound = false;
    for (int doubling = 0; doubling < kDoublings && !isFound; ++doubling) {
      isFound = finds(high);
      if (!isFound) high *= 2.0;
    }
    double low = 0.5 * high;
    for (int halving = 0; halving < kHalvings; ++halving) {
      const double middle = 0.5 * (low + high);
      const bool isFoundInBetween = finds(middle);
      (isFoundInBetween ? high : low) = middle;
      isFound = isFound || isFoundInBetween;
    }
    limits.push_back(isFound ? high : std::numeric_limits<double>::infinity());
  }
  return quantile(limits);
}

}  // namespace tractiond::solve

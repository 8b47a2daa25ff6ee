#include "daemon/solve/model.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace tractiond::solve {
namespace {

/// Times that missing displacements are completed: the first time the missing ones themselves pass for forces.
constexpr int kCompletions = 2;

/// Times that roughness is added in the last round: each shows more of the contact that the next one is a share of.
constexpr int kRoughenings = 2;

int mostOf(const ModelOptions& options) {
  int most = 0;
  for (const auto& rounds : options.most) most = std::max(most, *std::max_element(rounds.begin(), rounds.end()));
  return most;
}

}  // namespace

Model::Model(const Factors& factors, const Atoms& atoms, const ModelOptions& options)
    : factors_(factors)
    , atoms_(atoms)
    , options_(options)
    , amplitudes_(factors)
    , evidence_(factors, atoms, options)
    , prior_(atoms, options)
    , selection_(factors, options)
    , roughness_(atoms, options)
    , posterior_(factors, atoms, mostOf(options))
    , displacement_(static_cast<std::size_t>(factors.influence.stride()))
    , first_(static_cast<std::size_t>(atoms.count()))
    , noise_(static_cast<std::size_t>(mostOf(options)))
    , pointForce_(3 * static_cast<std::size_t>(atoms.pointCount()))
    , left_(factors.singularValues.size()) {
  assert(factors.atomCount() == atoms.count() && factors.pointCount() == atoms.pointCount());
  resize(moments_, atoms.count());
  resize(rest_, atoms.count());
  chosen_.reserve(mostOf(options));
  smooth_.reserve(mostOf(options));
}

void Model::solve(std::span<const float> displacement_px, std::span<const int> missing, double noise_px,
                  Estimate& estimate) noexcept {
  assert(estimate.force_N.size() == pointForce_.size());
  std::copy(displacement_px.begin(), displacement_px.end(), displacement_.data());
  const auto coordinates = static_cast<int>(displacement_px.size());
  const Displacements picture{displacement_.data(), missing,
                              dotProduct(displacement_.data(), displacement_.data(), coordinates), noise_px};
  found_ = false;
  estimate.outcome = Estimate::Outcome::kNothing;
  std::fill(estimate.force_N.begin(), estimate.force_N.end(), 0.0);
  estimate.wrench = {};
  estimate.covariance = {};
  estimate.motion = {};
  estimate.squaredResidual_px2 = picture.squares_px2;
  estimate.degrees = 0.0;
  estimate.atoms = estimate.rounds = 0;

  if (!std::isfinite(picture.squares_px2)) {
    fail(estimate);
    return;
  }
  look(picture, displacement_px);
  if (!shows(moments_, options_.detection)) {
    publishNothing(picture, estimate);
    return;
  }
  for (std::size_t time = 0; time < options_.most.size(); ++time) {
    const auto& rounds = options_.most[time];
    for (std::size_t i = 0; i < rounds.size(); ++i) {
      const Found found = round(picture, rounds[i], i + 1 == rounds.size());
      ++estimate.rounds;
      if (found == Found::kNothing) {
        publishNothing(picture, estimate);
        return;
      }
      if (found == Found::kFailed) {
        fail(estimate);
        return;
      }
    }
    if (time + 1 == options_.most.size() || !looksAgain(picture)) break;
  }
  publish(estimate);
}

/// Starts with all atoms alike.
void Model::look(const Displacements& picture, std::span<const float> displacement_px) {
  amplitudes_.take(displacement_px, picture.missing);
  for (int i = 0; i < kCompletions && !picture.missing.empty(); ++i) {
    amplitudes_.complete(evidence_.typicalForce_N(amplitudes_.values(), picture.noise_px), picture.noise_px);
  }
  evidence_.start(amplitudes_.values(), picture.noise_px, moments_);
  first_ = moments_.known;
}

bool Model::shows(const AtomMoments& moments, double surety) const {
  for (int a = 0; a < atoms_.count(); ++a) {
    if (evident(moments, a, surety) > 0.0) return true;
  }
  return false;
}

/// Does one round: prior, selection, posterior. Its moments are what the next round begins with.
Model::Found Model::round(const Displacements& picture, int most, bool last) {
  if (!prior_.follow(moments_)) return Found::kNothing;
  selection_.choose(prior_.gamma_N2(), most, true, picture.noise_px, chosen_);
  if (chosen_.atoms.empty()) return Found::kNothing;
  if (last) {
    if (!roughen(picture, most)) return Found::kFailed;
  } else {
    prior_.direct(chosen_, false);
    if (!posterior_.fit(picture, chosen_)) return Found::kFailed;
  }
  // Atoms without a force stay what the picture would tell of them: else the others' prior has no end.
  keepMean();
  std::fill(moments_.noise_N2.begin(), moments_.noise_N2.end(), 0.0);
  moments_.known = first_;
  if (!last) posterior_.noise_N2(noise_);  // after the last one looksAgain() may ask for it
  keep(moments_);
  return Found::kAtoms;
}

/// Adds the roughness and solves, twice: the second time from the forces of the first.
bool Model::roughen(const Displacements& picture, int most) {
  std::swap(smooth_, chosen_);
  for (int time = 0; time < kRoughenings; ++time) {
    if (time > 0) {
      keepMean();
      prior_.see(moments_);
    }
    selection_.choose(roughness_.add(moments_.mean_N, smooth_), most, false, picture.noise_px, chosen_);
    prior_.direct(chosen_, true);
    if (!posterior_.fit(picture, chosen_)) return false;
  }
  return true;
}

/// Takes the forces that were found, all others being 0.
void Model::keepMean() {
  std::fill(moments_.mean_N.begin(), moments_.mean_N.end(), 0.0);
  for (std::size_t i = 0; i < chosen_.atoms.size(); ++i) {
    const auto force = posterior_.forces_N().subspan(3 * i, 3);
    std::copy(force.begin(), force.end(), moments_.mean_N.begin() + 3 * std::ptrdiff_t{chosen_.atoms[i]});
  }
}

/// Puts what was found of the chosen atoms in its place.
void Model::keep(AtomMoments& moments) {
  degrees_ = 0.0;
  for (std::size_t i = 0; i < chosen_.atoms.size(); ++i) {
    const auto atom = static_cast<std::size_t>(chosen_.atoms[i]);
    const auto force = posterior_.forces_N().subspan(3 * i, 3);
    std::copy(force.begin(), force.end(), moments.mean_N.begin() + static_cast<std::ptrdiff_t>(3 * atom));
    moments.known[atom] = posterior_.known()[i];
    moments.noise_N2[atom] = noise_[i];
    degrees_ += posterior_.known()[i];
  }
}

/// Returns whether the residual exceeds the noise and shows an atom; then adds its moments to those that were found.
bool Model::looksAgain(const Displacements& picture) {
  const auto coordinates = static_cast<double>(factors_.coordinateCount() - std::ssize(picture.missing));
  const double expected =
      square(picture.noise_px) * (coordinates - degrees_ + options_.gate * std::sqrt(2.0 * coordinates));
  if (posterior_.squaredResidual_px2() < expected) return false;
  addUp(atoms_, moments_.mean_N, pointForce_);
  std::copy(amplitudes_.values().begin(), amplitudes_.values().end(), left_.begin());
  evidence_.subtract(pointForce_, left_);
  evidence_.start(left_, picture.noise_px, rest_);
  if (!shows(rest_, options_.surety)) return false;

  first_ = rest_.known;
  posterior_.noise_N2(noise_);
  keep(rest_);
  std::swap(moments_, rest_);
  return true;
}

void Model::fail(Estimate& estimate) {
  estimate.outcome = Estimate::Outcome::kFailed;
  estimate.squaredResidual_px2 = 0.0;
}

void Model::publishNothing(const Displacements& picture, Estimate& estimate) {
  chosen_.atoms.clear();
  chosen_.gamma_N2.clear();
  chosen_.covariance_N2.clear();
  if (!posterior_.fit(picture, chosen_)) {
    fail(estimate);
    return;
  }
  estimate.motion = posterior_.motion();
  estimate.squaredResidual_px2 = posterior_.squaredResidual_px2();
}

void Model::publish(Estimate& estimate) {
  found_ = true;
  estimate.outcome = Estimate::Outcome::kFound;
  addUp(atoms_, moments_.mean_N, estimate.force_N);
  estimate.wrench = posterior_.wrench();
  posterior_.wrenchCovariance(estimate.covariance);
  estimate.motion = posterior_.motion();
  estimate.squaredResidual_px2 = posterior_.squaredResidual_px2();
  estimate.degrees = degrees_;
  estimate.atoms = static_cast<int>(chosen_.atoms.size());
}

void Model::nodeDeviations_N(std::span<double> deviations) noexcept {
  if (found_) {
    posterior_.nodeDeviations_N(deviations);
  } else {
    std::fill(deviations.begin(), deviations.end(), 0.0);
  }
}

void Model::covariance(std::span<const double> weights, int count, std::span<double> covariance) noexcept {
  if (found_) {
    posterior_.covariance(weights, count, covariance);
  } else {
    std::fill_n(covariance.begin(), count * count, 0.0);
  }
}

}  // namespace tractiond::solve

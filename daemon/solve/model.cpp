#include "daemon/solve/model.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace tractiond::solve {
namespace {

/// Times that roughness is added in the last round: each shows more of the contact that the next one is a share of.
constexpr int kRoughenings = 2;

/// Squared deviations that patches leave more than the field, beyond which they are not looked at.
constexpr double kHopeless = 2000.0;

/// Deviations of the surest force from which on one patch that leaves nothing but noise is all there is to consider. Of
/// 1,800 frames of the evaluation's families 180 have such a patch; none of their fields alone comes nearer to it than
/// e^-18. From 120 deviations on it was e^-5.
constexpr double kStrong = 180.0;

/// Standard deviations above their expectation that the squared deviations beside a patch may have as noise.
constexpr double kNoise = 2.5;

/// The products that are kept of a frame's atoms are those of so many rounds with the most atoms.
constexpr int kKept = 3;

/// Candidates of even contacts and of patches.
constexpr int kEven = static_cast<int>(EvenField::kRoughness.size());
constexpr int kPatched = static_cast<int>(AroundPatches::kRoughness.size());

}  // namespace

void takeMeans(Mixture& mixture, Estimate& estimate) {
  estimate.outcome = Estimate::Outcome::kFound;
  const auto forces = mixture.pointForces_N();
  assert(estimate.force_N.size() == forces.size());
  std::copy(forces.begin(), forces.end(), estimate.force_N.begin());
  std::copy_n(mixture.couples_Nm().begin(), estimate.couple_Nm.size(), estimate.couple_Nm.begin());
  estimate.wrench = mixture.wrench();
  mixture.wrenchCovariance(estimate.covariance);
  estimate.motion = mixture.motion();
  estimate.squaredResidual_px2 = mixture.squaredResidual_px2();
}

Model::Model(const Factors& factors, const Atoms& atoms, const ModelOptions& options)
    : factors_(factors)
    , atoms_(atoms)
    , options_(options)
    , modes_(factors, atoms, options)
    , prior_(atoms, options)
    , selection_(factors, options)
    , roughness_(factors, atoms, options)
    , products_(factors, std::min(kKept * options.mostOfAnyRound(), atoms.count()))
    , posterior_(factors, atoms, options.mostOfAnyRound())
    , mixture_(atoms, 1 + kEven + kPatched)
    , displacement_(factors.influence.stride())
    , first_(atoms.count())
    , noise_(options.mostOfAnyRound())
    , pointForce_(3 * atoms.pointCount())
    , left_(factors.singularValues.size())
    , evidentForce_(pointForce_.size()) {
  assert(factors.atomCount() == atoms.count() && factors.pointCount() == atoms.pointCount());
  resize(moments_, atoms.count());
  resize(rest_, atoms.count());
  solved_.reserve(1 + kEven + kPatched);
  chosen_.reserve(options.mostOfAnyRound());
  smooth_.reserve(options.mostOfAnyRound());
}

Model::Model(const sensor::Sensor& sensor, const Factors& factors, const Atoms& atoms, const ModelOptions& options)
    : Model(factors, atoms, options) {
  if (!PatchInfluence::possible(atoms)) return;
  const auto stride = static_cast<std::size_t>(factors.influence.stride());
  patched_.emplace(
      Patched{EvenField(factors, atoms, options_, selection_, roughness_), RoundPatches(sensor, atoms, factors),
              AroundPatches(factors, atoms, options_, prior_, selection_, roughness_), LineArray<double>(stride),
              LineArray<double>(stride), std::vector<float>(factors.coordinateCount())});
}

void Model::solve(std::span<const float> displacement_px, std::span<const int> missing, double noise_px,
                  Estimate& estimate, std::span<const float> variance_px2) noexcept {
  std::copy(displacement_px.begin(), displacement_px.end(), displacement_.data());
  const auto coordinates = static_cast<int>(displacement_px.size());
  picture_ = {displacement_.data(), missing, dotProduct(displacement_.data(), displacement_.data(), coordinates),
              noise_px};
  const Displacements& picture = picture_;
  clear(estimate);
  mixture_.clear();
  solved_.clear();
  patchedParts_ = evenParts_ = {};
  products_.begin(picture);
  switch (std::isfinite(picture.squares_px2) ? findCandidates(picture, displacement_px, variance_px2, estimate.rounds)
                                             : Found::kFailed) {
  case Found::kFailed:
    estimate.outcome = Estimate::Outcome::kFailed;
    return;
  case Found::kNothing:
    publishNothing(picture, estimate);
    return;
  case Found::kForces:
    break;
  }
  mixture_.weigh();
  if (shareOf(patchedParts_) > 0.5) patched_->patches.join(picture);
  publish(estimate);
}

/// Fills the mixture.
Model::Found Model::findCandidates(const Displacements& picture, std::span<const float> displacement_px,
                                   std::span<const float> variance_px2, int& rounds) {
  if (!modes_.detect(picture, displacement_px, variance_px2)) return Found::kNothing;
  if (patched_ && findOnePatch(picture, displacement_px)) {
    addPatches();
    return Found::kForces;
  }
  const Found found = findField(picture, rounds);
  if (found != Found::kForces) return found;
  addField();
  if (!patched_) return found;
  const double enough = posterior_.squaredResidual_px2() / square(picture.noise_px) + degrees_;
  const bool hasPatches = findPatches(picture);
  if (hasPatches) addPatches();
  // Where patches explain the picture nothing else needs to.
  if (!hasPatches || patched_->patches.misfit() > enough) addEvenField(picture);
  return found;
}

/// Does the rounds; those of the second search, too, if the residual shows more.
Model::Found Model::findField(const Displacements& picture, int& rounds) {
  modes_.start(moments_);
  first_ = moments_.known;
  for (std::size_t time = 0; time < options_.most.size(); ++time) {
    const auto& most = options_.most[time];
    for (std::size_t i = 0; i < most.size(); ++i) {
      const Found found = round(picture, most[i], i + 1 == most.size());
      ++rounds;
      if (found != Found::kForces) return found;
    }
    if (time + 1 == options_.most.size() || !detectInResidual(picture)) break;
  }
  return Found::kForces;
}

/// Does one round: prior, selection, posterior. Its moments are what the next round begins with.
Model::Found Model::round(const Displacements& picture, int most, bool last) {
  if (!choose(picture, most)) {
    std::fill(moments_.mean_N.begin(), moments_.mean_N.end(), 0.0);
    std::fill(moments_.noise_N2.begin(), moments_.noise_N2.end(), 0.0);
    makeEvident(modes_.surest(), moments_);
    if (!choose(picture, most)) return Found::kNothing;
  }
  if (last) {
    if (!roughen(picture, most)) return Found::kFailed;
  } else {
    prior_.direct(chosen_, false);
    if (!posterior_.fit(picture, products_, chosen_)) return Found::kFailed;
  }
  // Atoms without a force stay what the picture would tell of them: else the others' prior has no end.
  keepMean();
  std::fill(moments_.noise_N2.begin(), moments_.noise_N2.end(), 0.0);
  moments_.known = first_;
  if (!last) posterior_.noise_N2(noise_);  // after the last one detectInResidual() may ask for it
  degrees_ = posterior_.keep(noise_, moments_);
  return Found::kForces;
}

/// Chooses atoms by the moments. Returns false if there are none.
bool Model::choose(const Displacements& picture, int most) {
  if (!prior_.findGamma(moments_)) return false;
  selection_.choose(prior_.gamma_N2(), most, true, picture.noise_px, chosen_);
  return !chosen_.atoms.empty();
}

/// Adds the roughness and solves, twice: the second time from the forces of the first, and what may be unseen around
/// them as well.
bool Model::roughen(const Displacements& picture, int most) {
  std::swap(smooth_, chosen_);
  for (int time = 0; time < kRoughenings; ++time) {
    if (time > 0) {
      keepMean();
      addUp(atoms_, moments_.mean_N, evidentForce_);
      prior_.findEvident(moments_);
    }
    const double unseen_px = time == 0 ? 0.0 : options_.unseen * picture.noise_px;
    const auto gamma = roughness_.add(moments_.mean_N, smooth_, unseen_px);
    selection_.choose(gamma, most, false, picture.noise_px, chosen_);
    prior_.direct(chosen_, true);
    if (!posterior_.fit(picture, products_, chosen_)) return false;
  }
  return true;
}

/// Takes the forces that were found, all others being 0.
void Model::keepMean() {
  posterior_.allForces_N(moments_.mean_N);
}

/// Returns whether the residual exceeds the noise and shows an atom; then adds its moments to those that were found.
bool Model::detectInResidual(const Displacements& picture) {
  const auto coordinates = static_cast<double>(factors_.coordinateCount() - std::ssize(picture.missing));
  const double expected =
      square(picture.noise_px) * (coordinates - degrees_ + options_.gate * std::sqrt(2.0 * coordinates));
  if (posterior_.squaredResidual_px2() < expected) return false;
  addUp(atoms_, moments_.mean_N, pointForce_);
  const auto amplitudes = modes_.amplitudes();
  std::copy(amplitudes.begin(), amplitudes.end(), left_.begin());
  const std::span left(left_.data(), amplitudes.size());
  modes_.evidence().subtract(pointForce_, left);
  const SurestForce surest = modes_.evidence().surest(left, picture.noise_px);
  if (surest.squaredDeviations < square(options_.surety)) return false;
  modes_.evidence().start(left, picture.noise_px, surest, rest_);

  first_ = rest_.known;
  posterior_.noise_N2(noise_);
  posterior_.keep(noise_, rest_);
  std::swap(moments_, rest_);
  return true;
}

/// Adds a candidate to the mixture. Returns the array of its points' forces.
std::span<double> Model::add(Posterior& posterior, double logEvidence, const std::array<double, 6>& wrench,
                             const FreedPatches* patches) {
  solved_.push_back({&posterior, posterior.logEvidence() - logEvidence, patches});
  return mixture_.add(posterior, logEvidence, wrench);
}

void Model::addField() {
  addUp(atoms_, moments_.mean_N, add(posterior_, posterior_.logEvidence() - kOptimism * degrees_, posterior_.wrench()));
}

/// Looks for one patch that explains a strong contact alone, and solves the field around it. False: it does not, or
/// there is none; look() has then been done again if need be.
bool Model::findOnePatch(const Displacements& picture, std::span<const float> displacement_px) {
  if (modes_.surest().squaredDeviations < square(kStrong)) return false;
  const auto coordinates = static_cast<double>(factors_.coordinateCount() - std::ssize(picture.missing));
  const double enough = coordinates + kNoise * std::sqrt(2.0 * coordinates);
  if (!patched_->patches.findOne(picture, atoms_.places.col(modes_.surest().atom), enough)) return false;
  if (!leavePatches(picture)) return false;
  resize(rest_, atoms_.count());
  if (modes_.look(picture, patched_->stillRounded).squaredDeviations < square(options_.surety) &&
      solveAroundPatches(picture))
    return true;
  modes_.look(picture, displacement_px);
  return false;
}

/// Fits patches to the picture, and the field around them. False: there are none, or they leave so much more than the
/// field that they cannot be right.
bool Model::findPatches(const Displacements& picture) {
  const double residual = posterior_.squaredResidual_px2() / square(picture.noise_px);
  RoundPatches& patches = patched_->patches;
  if (!patches.find(picture, evidentForce_, residual + degrees_)) return false;
  if (!(patches.misfit() - residual < kHopeless)) return false;
  if (!leavePatches(picture)) return false;
  if (modes_.look(picture, patched_->stillRounded).squaredDeviations < square(options_.surety)) {
    resize(rest_, atoms_.count());
  } else {
    modes_.start(rest_);
  }
  return solveAroundPatches(picture);
}

/// Sets what the patches leave. False: the equations could not be solved.
bool Model::leavePatches(const Displacements& picture) {
  auto& [even, patches, around, left, still, rounded] = *patched_;
  if (!patches.linearise(picture)) return false;
  patches.leave(left.data(), still.data());
  std::copy_n(still.data(), rounded.size(), rounded.begin());
  return true;
}

/// Solves the field around the patches, which begins with rest_.
bool Model::solveAroundPatches(const Displacements& picture) {
  auto& [even, patches, around, left, still, rounded] = *patched_;
  const double squares = dotProduct(left.data(), left.data(), static_cast<int>(rounded.size()));
  return around.solve({left.data(), picture.missing, squares, picture.noise_px}, products_, rest_, patches);
}

/// Solves for an even contact.
void Model::addEvenField(const Displacements& picture) {
  EvenField& even = patched_->even;
  if (!even.solve(picture, products_, evidentForce_, degrees_, mixture_.mostWorth())) return;
  evenParts_ = {mixture_.count(), mixture_.count() + even.count()};
  for (int i = 0; i < even.count(); ++i) {
    even.pointForces_N(i, add(even.posterior(i), even.logEvidence(i), even.posterior(i).wrench()));
  }
}

double Model::shareOf(const Parts& parts) const {
  double sum = 0.0;
  for (int i = parts.first; i < parts.end; ++i) sum += mixture_.share(i);
  return sum;
}

void Model::addPatches() {
  AroundPatches& around = patched_->around;
  patchedParts_ = {mixture_.count(), mixture_.count() + kPatched};
  for (int i = 0; i < kPatched; ++i) {
    around.pointForces_N(i, add(around.posterior(i), around.logEvidence(i), around.wrench(i), &around.freed()));
  }
}

void Model::clear(Estimate& estimate) {
  std::fill(estimate.force_N.begin(), estimate.force_N.end(), 0.0);
  std::vector<double> forces = std::move(estimate.force_N);
  estimate = Estimate{};
  estimate.force_N = std::move(forces);
}

void Model::publishNothing(const Displacements& picture, Estimate& estimate) {
  chosen_.atoms.clear();
  chosen_.gamma_N2.clear();
  chosen_.covariance_N2.clear();
  if (!posterior_.fit(picture, products_, chosen_)) {
    estimate.outcome = Estimate::Outcome::kFailed;
    return;
  }
  estimate.motion = posterior_.motion();
  estimate.squaredResidual_px2 = posterior_.squaredResidual_px2();
}

void Model::publish(Estimate& estimate) {
  takeMeans(mixture_, estimate);
  estimate.degrees = degrees_;
  estimate.atoms = static_cast<int>(chosen_.atoms.size());
  estimate.evenShare = shareOf(evenParts_);
  if (patchedParts_.end == 0) return;
  estimate.patchCount = patched_->around.freed().count();
  estimate.patchShare = shareOf(patchedParts_);
  for (int k = 0; k < estimate.patchCount; ++k) {
    FoundPatch& found = estimate.patches[k];
    found = patched_->around.found(k);
    if (estimate.patchShare > 0.5) found.contact = patched_->patches.contactOf(k);
  }
}

}  // namespace tractiond::solve

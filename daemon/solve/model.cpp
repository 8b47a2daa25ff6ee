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

/// Deviations of the most significant force from which on one patch that leaves nothing but noise is all there is to
/// consider. Of 1,800 frames of the evaluation's families 180 have such a patch; none of their fields alone comes
/// nearer to it than e^-18. From 120 deviations on it was e^-5.
constexpr double kStrong = 180.0;

/// Standard deviations above their expectation that the squared deviations beside a patch may have as noise.
constexpr double kNoise = 2.5;

/// The most atoms of a round.
constexpr int kMost = ModelConstants::kMostOfAnyRound;

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
  estimate.evenShare = mixture.shareOf(Mixture::Kind::kEven);
  estimate.patchShare = mixture.shareOf(Mixture::Kind::kPatched);
}

void explainByMotion(const Displacements& picture, AtomProducts& products, Posterior& posterior, Estimate& estimate) {
  static const Chosen kNone;
  estimate.outcome = Estimate::Outcome::kFailed;
  if (!posterior.fit(picture, products, kNone)) return;
  estimate.outcome = Estimate::Outcome::kNothing;
  estimate.motion = posterior.motion();
  estimate.squaredResidual_px2 = posterior.squaredResidual_px2();
}

Model::Model(const Factors& factors, const Atoms& atoms, const SolveOptions& options)
    : factors_(factors)
    , atoms_(atoms)
    , modes_(factors, atoms, options)
    , prior_(atoms)
    , selection_(factors)
    , roughness_(factors, atoms)
    , products_(factors, std::min(kKept * kMost, atoms.count()))
    , posterior_(factors, atoms, kMost)
    , mixture_(atoms, 1 + kEven + kPatched)
    , first_(atoms.count())
    , noise_(kMost)
    , pointForce_(3 * atoms.pointCount())
    , evidentForce_(pointForce_.size()) {
  assert(factors.atomCount() == atoms.count() && factors.pointCount() == atoms.pointCount());
  resize(moments_, atoms.count());
  resize(rest_, atoms.count());
  solved_.reserve(1 + kEven + kPatched);
  chosen_.reserve(kMost);
  smooth_.reserve(kMost);
}

Model::Model(const sensor::Sensor& sensor, const Factors& factors, const Atoms& atoms, const SolveOptions& options)
    : Model(factors, atoms, options) {
  if (!PatchInfluence::possible(atoms)) return;
  const auto stride = static_cast<std::size_t>(factors.influence.stride());
  patched_.emplace(Patched{EvenField(factors, atoms, selection_, roughness_), RoundPatches(sensor, atoms, factors),
                           AroundPatches(factors, atoms, prior_, selection_, roughness_), LineArray<double>(stride),
                           LineArray<double>(stride), std::vector<float>(factors.coordinateCount())});
}

void Model::solve(const Displacements& picture, Estimate& estimate, std::span<const float> variance_px2) noexcept {
  picture_ = picture;
  clear(estimate);
  mixture_.clear();
  solved_.clear();
  products_.begin(picture_);
  estimate.outcome =
      std::isfinite(picture.squares_px2) ? findCandidates(variance_px2, estimate.rounds) : Outcome::kFailed;
  if (estimate.outcome == Outcome::kNothing) explainByMotion(picture_, products_, posterior_, estimate);
  if (estimate.outcome == Outcome::kFound) publish(estimate);
}

/// Fills the mixture.
Estimate::Outcome Model::findCandidates(std::span<const float> variance_px2, int& rounds) {
  if (!modes_.detect(picture_, variance_px2)) return Outcome::kNothing;
  if (patched_ && findOnePatch()) {
    addPatches();
    return Outcome::kFound;
  }
  const Outcome found = findField(rounds);
  if (found != Outcome::kFound) return found;
  addField();
  if (!patched_) return found;
  const double enough = posterior_.squaredResidual_px2() / square(picture_.noise_px) + degrees_;
  const bool hasPatches = findPatches();
  if (hasPatches) addPatches();
  // Where patches explain the picture nothing else needs to.
  if (!hasPatches || patched_->patches.misfit() > enough) addEvenField();
  return found;
}

/// Does the rounds; those of the second search, too, if the residual shows more.
Estimate::Outcome Model::findField(int& rounds) {
  modes_.start(moments_);
  first_ = moments_.known;
  for (const auto& most : ModelConstants::kMost) {
    for (std::size_t i = 0; i < most.size(); ++i) {
      const Outcome found = round(most[i], i + 1 == most.size());
      ++rounds;
      if (found != Outcome::kFound) return found;
    }
    if (&most == &ModelConstants::kMost.back() || !detectInResidual()) break;
  }
  return Outcome::kFound;
}

/// Does one round: prior, selection, posterior. Its moments are what the next round begins with.
Estimate::Outcome Model::round(int most, bool last) {
  if (!choose(most)) {
    std::fill(moments_.mean_N.begin(), moments_.mean_N.end(), 0.0);
    std::fill(moments_.noise_N2.begin(), moments_.noise_N2.end(), 0.0);
    makeEvident(modes_.best(), moments_);
    if (!choose(most)) return Outcome::kNothing;
  }
  if (last) {
    if (!roughen(most)) return Outcome::kFailed;
  } else {
    prior_.direct(chosen_, false);
    if (!posterior_.fit(picture_, products_, chosen_)) return Outcome::kFailed;
  }
  // Atoms without a force stay what the picture would tell of them: else the others' prior has no end.
  posterior_.allForces_N(moments_.mean_N);
  std::fill(moments_.noise_N2.begin(), moments_.noise_N2.end(), 0.0);
  moments_.known = first_;
  if (!last) posterior_.noise_N2(noise_);  // after the last one detectInResidual() may ask for it
  degrees_ = posterior_.keep(noise_, moments_);
  return Outcome::kFound;
}

/// Chooses atoms by the moments. Returns false if there are none.
bool Model::choose(int most) {
  if (!prior_.findGamma(moments_)) return false;
  selection_.choose(prior_.gamma_N2(), most, true, picture_.noise_px, chosen_);
  return !chosen_.atoms.empty();
}

/// Adds the roughness and solves, twice: the second time from the forces of the first, and what may be unseen around
/// them as well.
bool Model::roughen(int most) {
  std::swap(smooth_, chosen_);
  for (int time = 0; time < kRoughenings; ++time) {
    if (time > 0) {
      posterior_.allForces_N(moments_.mean_N);
      addUp(atoms_, moments_.mean_N, evidentForce_);
      prior_.findEvident(moments_);
    }
    const double unseen_px = time == 0 ? 0.0 : ModelConstants::kUnseen * picture_.noise_px;
    const auto gamma = roughness_.add(moments_.mean_N, smooth_, unseen_px);
    selection_.choose(gamma, most, false, picture_.noise_px, chosen_);
    prior_.direct(chosen_, true);
    if (!posterior_.fit(picture_, products_, chosen_)) return false;
  }
  return true;
}

/// Returns whether the residual exceeds the noise and shows an atom; then adds its moments to those that were found.
bool Model::detectInResidual() {
  const auto coordinates = static_cast<double>(factors_.coordinateCount() - std::ssize(picture_.missing));
  const double expected =
      square(picture_.noise_px) * (coordinates - degrees_ + ModelConstants::kGate * std::sqrt(2.0 * coordinates));
  if (posterior_.squaredResidual_px2() < expected) return false;
  addUp(atoms_, moments_.mean_N, pointForce_);
  if (!modes_.startBeside(pointForce_, rest_)) return false;

  first_ = rest_.known;
  posterior_.noise_N2(noise_);
  posterior_.keep(noise_, rest_);
  std::swap(moments_, rest_);
  return true;
}

/// Adds a candidate to the mixture. Returns the array of its points' forces.
std::span<double> Model::add(Posterior& posterior, Mixture::Kind kind, double logEvidence, const Wrench& wrench) {
  solved_.push_back({&posterior, posterior.logEvidence() - logEvidence});
  return mixture_.add(posterior, kind, logEvidence, wrench);
}

void Model::addField() {
  const double logEvidence = posterior_.logEvidence() - kOptimism * degrees_;
  addUp(atoms_, moments_.mean_N, add(posterior_, Mixture::Kind::kField, logEvidence, posterior_.wrench()));
}

/// Looks for one patch that explains a strong contact alone, and solves the field around it. False: it does not, or
/// there is none; look() has then been done again if need be.
bool Model::findOnePatch() {
  if (modes_.best().squaredDeviations < square(kStrong)) return false;
  const auto coordinates = static_cast<double>(factors_.coordinateCount() - std::ssize(picture_.missing));
  const double enough = coordinates + kNoise * std::sqrt(2.0 * coordinates);
  if (!patched_->patches.findOne(picture_, atoms_.places.col(modes_.best().atom), enough)) return false;
  if (!leavePatches()) return false;
  resize(rest_, atoms_.count());
  if (lookBesidePatches().squaredDeviations < square(ModelConstants::kSignificance) && solveAroundPatches())
    return true;
  modes_.look(picture_);
  return false;
}

/// Fits patches to the picture, and the field around them. False: there are none, or they leave so much more than the
/// field that they cannot be right.
bool Model::findPatches() {
  const double residual = posterior_.squaredResidual_px2() / square(picture_.noise_px);
  RoundPatches& patches = patched_->patches;
  if (!patches.find(picture_, evidentForce_, residual + degrees_)) return false;
  if (!(patches.misfit() - residual < kHopeless)) return false;
  if (!leavePatches()) return false;
  if (lookBesidePatches().squaredDeviations < square(ModelConstants::kSignificance)) {
    resize(rest_, atoms_.count());
  } else {
    modes_.start(rest_);
  }
  return solveAroundPatches();
}

/// Sets what the patches leave. False: the equations could not be solved.
bool Model::leavePatches() {
  auto& [even, patches, around, left, still, rounded] = *patched_;
  if (!patches.linearise(picture_)) return false;
  patches.leave(left.data(), still.data());
  std::copy_n(still.data(), rounded.size(), rounded.begin());
  return true;
}

/// Looks at what the patches leave, without the picture's motion.
const BestForce& Model::lookBesidePatches() {
  return modes_.look({patched_->still.data(), picture_.missing, 0.0, picture_.noise_px, patched_->stillRounded});
}

/// Solves the field around the patches, which begins with rest_.
bool Model::solveAroundPatches() {
  auto& [even, patches, around, left, still, rounded] = *patched_;
  const double squares = dotProduct(left.data(), left.data(), factors_.coordinateCount());
  return around.solve({left.data(), picture_.missing, squares, picture_.noise_px, {}}, products_, rest_, patches);
}

/// Solves for an even contact.
void Model::addEvenField() {
  EvenField& even = patched_->even;
  if (!even.solve(picture_, products_, evidentForce_, degrees_, mixture_.mostWorth())) return;
  for (int i = 0; i < even.count(); ++i) {
    even.pointForces_N(i,
                       add(even.posterior(i), Mixture::Kind::kEven, even.logEvidence(i), even.posterior(i).wrench()));
  }
}

void Model::addPatches() {
  AroundPatches& around = patched_->around;
  for (int i = 0; i < kPatched; ++i) {
    around.pointForces_N(i, add(around.posterior(i), Mixture::Kind::kPatched, around.logEvidence(i), around.wrench(i)));
  }
}

void Model::clear(Estimate& estimate) {
  std::fill(estimate.force_N.begin(), estimate.force_N.end(), 0.0);
  std::vector<double> forces = std::move(estimate.force_N);
  estimate = Estimate{};
  estimate.force_N = std::move(forces);
}

void Model::publish(Estimate& estimate) {
  mixture_.weigh();
  takeMeans(mixture_, estimate);
  estimate.atoms = static_cast<int>(chosen_.atoms.size());
  if (estimate.patchShare == 0.0) return;
  const bool areLikely = estimate.patchShare > 0.5;
  if (areLikely) patched_->patches.join(picture_);
  estimate.patchCount = freed().count();
  for (int k = 0; k < estimate.patchCount; ++k) {
    estimate.patches[k] = patched_->around.found(k);
    if (areLikely) estimate.patches[k].contact = patched_->patches.contactOf(k);
  }
}

}  // namespace tractiond::solve

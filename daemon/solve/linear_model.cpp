#include "daemon/solve/linear_model.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
#include <numeric>
#include <tuple>
#include <utility>

namespace tractiond::solve {
namespace {

/// A candidate with a smaller share is left out.
constexpr double kLittle = 1e-3;

/// The model holds if the most significant force that it leaves has fewer deviations than kSignificant, or
/// kOwnSignificant times those that it left in its own picture; the same of the misfit, with kOwnMisfit more; and if
/// its prior need not grow beyond kMostScale: a place that is no longer right shows there alone.
constexpr double kSignificant = 5.0, kOwnSignificant = 1.25;
constexpr double kMisfit = 4.0, kOwnMisfit = 4.0;
constexpr double kMostScale = 2.0;
/// Farthest shift of a patch for which its curves hold [pitches].
constexpr double kMostShift = 1.2;
/// What patches do is made straight again until their shifts change by less than this [pitches], or so many times.
constexpr double kStraight = 0.01;
constexpr int kMostTimes = 4;

/// The least share of a patch's former load by which changes of its place are recognized.
constexpr double kLeastLoad = 0.1;

}  // namespace

LinearModel::LinearModel(const Factors& factors, const Atoms& atoms, std::shared_ptr<const StrongModes> modes)
    : factors_(factors)
    , atoms_(atoms)
    , test_(std::move(modes), LinearPosterior::mostUnknowns(ModelConstants::kMostOfAnyRound, kMostFreed),
            RoundPatches::kMost * RoundPatches::kPowers)
    , mixture_(atoms, kMost)
    , spread_(atoms)
    , shearSpread_(factors, atoms)
    , displacement_(factors.influence.stride())
    , straight_(displacement_.size())
    , shown_(factors.coordinateCount())
    , completed_(shown_.size())
    , coefficients_(shown_.size())
    , atomForces_(3 * atoms.count()) {
  for (int i = 0; i < kMost; ++i) {
    parts_.push_back({.posterior = LinearPosterior(factors, atoms, ModelConstants::kMostOfAnyRound, kMostFreed)});
  }
  for (auto* each : {&missingThen_, &missing_, &added_}) each->reserve(completed_.size());
}

bool LinearModel::make(Model& model, const Estimate& estimate, LinearScratch& scratch) {
  assert(estimate.outcome == Estimate::Outcome::kFound);
  const Displacements& picture = model.picture();
  missingThen_.assign(picture.missing.begin(), picture.missing.end());
  std::array<int, 16> order{};
  patches_ = {};
  count_ = model.mixture().count();
  assert(count_ <= std::ssize(order));
  for (int i = 0; i < count_; ++i) order[i] = i;
  std::sort(order.begin(), order.begin() + count_,
            [&](int a, int b) { return model.mixture().share(a) > model.mixture().share(b); });
  const auto isLittle = [&](int i) { return model.mixture().share(i) < kLittle; };
  count_ = static_cast<int>(std::find_if(order.begin(), order.begin() + count_, isLittle) - order.begin());
  count_ = std::min(count_, kMost);
  for (int i = 0; i < count_; ++i) {
    const int number = order[i];
    const Model::Solved& solved = model.solved(number);
    Part& part = parts_[i];
    const Wrench wrench = model.mixture().wrench(number);
    part.penalty = solved.penalty;
    part.kind = model.mixture().kind(number);
    if (part.isPatched() && patches_.count() == 0) {
      patches_ = model.freed();
      takeCurves(model.patches());
    }
    if (!part.posterior.make(*solved.posterior, model.products(), missingThen_,
                             std::hypot(wrench[0], wrench[1], wrench[2]), curvesOf(part), scratch))
      return false;
    if (i == 0 && part.isPatched()) shearSpread_.make(part.posterior, patches_, model.patches(), missingThen_);
    if (i == 0) test_.make(part.posterior, solved.posterior->extraUnknowns(), curvesOf(part));
  }
  for (int k = 0; k < estimate.patchCount; ++k) {
    contact_[k] = estimate.patchShare > 0.5 ? estimate.patches[k].contact : k;
  }
  atomCount_ = estimate.atoms;
  rounds_ = estimate.rounds;
  takePicture(picture);
  test_.begin(shown_);
  if (!solveFirst(picture.noise_px)) return false;
  own_ = doubt_;
  return true;
}

/// Takes what the patches displace beyond their slopes.
void LinearModel::takeCurves(const RoundPatches& patches) {
  LineArray<double> curves(RoundPatches::kPowers * factors_.influence.stride());
  curves_ = RowMatrix(RoundPatches::kPowers * patches_.count(), factors_.coordinateCount());
  for (int k = 0; k < patches_.count(); ++k) {
    patches.curves(k, curves.data());
    std::copy_n(curves.data(), curves.size(), curves_.row(RoundPatches::kPowers * k));
  }
}

bool LinearModel::answer(const Displacements& picture, const Modes& shown, Estimate& estimate) {
  takePicture(picture);
  for (std::size_t i = 0; i < picture.missing.size(); ++i) {
    shown_[picture.missing[i]] = static_cast<float>(shown.completed()[i]);
  }
  test_.begin(shown.matched());
  if (!solveFirst(picture.noise_px) || !holds()) return false;
  findSpreadRatios(picture.noise_px);
  mixture_.clear();
  for (Part& part : parts()) {
    if (&part != parts_.data() && !solve(part, picture.noise_px)) return false;
    LinearPosterior& posterior = part.posterior;
    addForces(part, mixture_.add(posterior, part.kind, posterior.logEvidence() - part.penalty, wrenchOf(part)));
  }
  mixture_.weigh();
  takeMeans(mixture_, estimate);
  estimate.atoms = atomCount_;
  estimate.rounds = rounds_;
  findPatches(estimate);
  return true;
}

/// Finds how far the shear of the patches is spread, by the likeliest candidate.
void LinearModel::findSpreadRatios(double noise_px) {
  spreadRatio_ = {};
  const Part& part = parts_.front();
  if (!part.isPatched()) return;
  std::array<RoundPatch, RoundPatches::kMost> now;
  std::array<double, RoundPatches::kMost> grown{};
  for (int k = 0; k < patches_.count(); ++k) now[k] = patchNow(part, k, grown[k]);
  const auto patches = std::span(now).first(patches_.count());
  for (int k = 0; k < patches_.count(); ++k) {
    spreadRatio_[k] =
        shearSpread_.find(part.posterior, patches_, patches, k, grown[k], straight_.data(), noise_px, added_);
  }
}

/// Returns whether nothing speaks against the model.
bool LinearModel::holds() const {
  return doubt_.significance < std::max(kSignificant, kOwnSignificant * own_.significance) &&
         doubt_.misfit < std::max(kMisfit, own_.misfit + kOwnMisfit) && doubt_.scale <= kMostScale &&
         doubt_.shift <= kMostShift;
}

/// Takes a picture; leaves out of displacement_ what one of the two pictures misses.
void LinearModel::takePicture(const Displacements& picture) {
  std::copy_n(picture.displacement_px, shown_.size(), displacement_.data());
  std::copy(picture.rounded_px.begin(), picture.rounded_px.end(), shown_.begin());
  const auto missing = picture.missing;
  missing_.clear();
  added_.clear();
  std::set_union(missing.begin(), missing.end(), missingThen_.begin(), missingThen_.end(),
                 std::back_inserter(missing_));
  std::set_difference(missing.begin(), missing.end(), missingThen_.begin(), missingThen_.end(),
                      std::back_inserter(added_));
  for (const int coordinate : missing_) displacement_.data()[coordinate] = 0.0;
}

/// Solves with one candidate. What its patches do is straightened for the shifts that it finds.
bool LinearModel::solve(Part& part, double noise_px) {
  shift_ = 0.0;
  times_.fill(0.0);
  if (!part.posterior.read(displacement_.data(), noise_px, added_, curvesOf(part))) return false;
  for (int time = 0;; ++time) {
    if (!part.posterior.solve(times(part))) return false;
    if (!part.isPatched() || time == kMostTimes) break;
    auto next = times_;
    if (straighten(part, next) < kStraight || shift_ > kMostShift) break;
    times_ = next;
  }
  const double squares_px2 = squaresWithoutCurves(part);
  part.posterior.weigh(squares_px2);
  return std::isfinite(squares_px2);
}

/// Sets how much there is of each curve by the shifts of the last answer. Returns how much the farthest shift has
/// changed [pitches].
double LinearModel::straighten(const Part& part, std::span<double> times) {
  double farthest = 0.0;
  auto to = times.begin();
  for (int k = 0; k < patches_.count(); ++k) {
    double grown = 0.0;
    const RoundPatch patch = patchNow(part, k, grown);
    const PatchPlace& then = patches_.patch(k).place;
    const double x = (patch.place.x_m - then.x_m) / atoms_.pitch_m, y = (patch.place.y_m - then.y_m) / atoms_.pitch_m;
    farthest = std::max(farthest, std::hypot(x, y));
    for (const double power : {x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y}) *to++ = grown * power;
  }
  return std::abs(farthest - std::exchange(shift_, farthest));
}

/// Returns the squares of the picture without the curves [px^2].
double LinearModel::squaresWithoutCurves(const Part& part) {
  std::array<int, std::tuple_size_v<decltype(times_)>> rows{};
  std::iota(rows.begin(), rows.end(), 0);
  const auto of = times(part);
  std::transform(of.begin(), of.end(), coefficients_.begin(), [](double each) { return static_cast<float>(-each); });
  std::copy_n(displacement_.data(), displacement_.size(), straight_.data());
  addRows(curvesOf(part), std::span(rows).first(of.size()), std::span(coefficients_).first(of.size()),
          straight_.data());
  for (const int coordinate : missing_) straight_.data()[coordinate] = 0.0;
  return dotProduct(straight_.data(), straight_.data(), factors_.coordinateCount());
}

/// Solves with the first candidate, which stands for all in doubt_.
bool LinearModel::solveFirst(double noise_px) {
  const Part& part = parts_.front();
  if (!solve(parts_.front(), noise_px)) return false;
  part.posterior.complete(missingThen_, added_, completed_);
  for (std::size_t i = 0; i < missing_.size(); ++i) {
    const int coordinate = missing_[i];
    double change = completed_[coordinate] - shown_[coordinate];
    for (std::size_t c = 0; c < times(part).size(); ++c) {
      change += times_[c] * curves_.row(static_cast<int>(c))[coordinate];
    }
    coefficients_[i] = static_cast<float>(change);
  }
  test_.add(missing_, std::span(coefficients_).first(missing_.size()));
  const auto degrees = static_cast<double>(std::ssize(completed_) - std::ssize(missing_));
  doubt_.significance = test_.significance(part.posterior, times(part), noise_px);
  doubt_.misfit = (part.posterior.misfit() - degrees) / std::sqrt(2.0 * degrees);
  doubt_.scale = part.posterior.scale();
  doubt_.shift = shift_;
  doubt_.force = part.posterior.grown();
  return true;
}

/// Returns the wrench. That of the posterior is linear: with a patch moves the load of then, not that of now.
Wrench LinearModel::wrenchOf(const Part& part) const {
  Wrench sum = part.posterior.wrench();
  for (int k = 0; part.isPatched() && k < patches_.count(); ++k) {
    double grown = 0.0;
    const RoundPatch now = patchNow(part, k, grown);
    const auto& [place, load] = patches_.patch(k);
    const Eigen::Vector3d away(now.place.x_m - place.x_m, now.place.y_m - place.y_m, 0.0);
    sum.tail<3>() += away.cross(Eigen::Vector3d((now.load - grown * load).head<3>()));
  }
  return sum;
}

/// Computes the forces of the points, and the couples.
void LinearModel::addForces(const Part& part, std::span<double> forces) {
  part.posterior.allForces_N(atomForces_);
  addUp(atoms_, atomForces_, forces);
  if (!part.isPatched()) {
    part.posterior.addExtraForces_N(forces);
    return;
  }
  for (int k = 0; k < patches_.count(); ++k) {
    double grown = 0.0;
    const RoundPatch patch = patchNow(part, k, grown);
    spread_.divide(patch.place, true);
    spread_.add(patch.load, k, forces);
  }
}

/// Returns a patch as a candidate has it.
/// \param grown its load as a multiple of that then: the unknown of a place is its change times this
RoundPatch LinearModel::patchNow(const Part& part, int patch, double& grown) const {
  PatchChange change = patches_.change(patch, part.posterior.extra());
  const PatchLoad then = patches_.patch(patch).load;
  grown = std::max(kLeastLoad, change.head<3>().dot(then.head<3>()) / then.head<3>().squaredNorm());
  change.tail<kPatchPlaces>() /= grown;
  change.head<kPatchLoads>() -= then;
  return patches_.changed(patch, change);
}

/// Computes the means of the patches over the candidates that have them.
void LinearModel::findPatches(Estimate& estimate) {
  estimate.patchCount = 0;
  if (estimate.patchShare == 0.0) return;
  estimate.patchCount = patches_.count();
  for (int k = 0; k < patches_.count(); ++k) {
    FoundPatch& found = estimate.patches[k] = {};
    found.spreadRatio = spreadRatio_[k];
    found.contact = estimate.patchShare > 0.5 ? contact_[k] : 0;
    PatchChange mean = PatchChange::Zero();
    const auto asVector = [](const RoundPatch& patch) {
      PatchChange all;
      all << patch.load, patch.place.x_m, patch.place.y_m, patch.place.spread_m2;
      return all;
    };
    const auto each = [&](auto use) {
      for (int i = 0; i < count_; ++i) {
        Part& part = parts_[i];
        const double share = mixture_.share(i) / estimate.patchShare;
        double grown = 0.0;
        if (!part.isPatched() || share == 0.0) continue;
        const RoundPatch patch = patchNow(part, k, grown);
        use(part, share, asVector(patch), grown);
      }
    };
    each([&](Part&, double share, const PatchChange& patch, double) { mean += share * patch; });
    std::array<int, kPerPatch> unknowns{};
    for (int i = 0; i < kPerPatch; ++i) unknowns[i] = patches_.index(k, i);
    each([&](Part& part, double share, const PatchChange& patch, double grown) {
      Eigen::Matrix<double, kPerPatch, kPerPatch, Eigen::RowMajor> within;
      part.posterior.extraCovariance(unknowns, {within.data(), static_cast<std::size_t>(within.size())});
      const PatchChange units = PatchChange::NullaryExpr(
          [&](Eigen::Index i) { return patches_.unit(k, static_cast<int>(i)) / (i < kPatchLoads ? 1.0 : grown); });
      found.covariance += share * (units.asDiagonal() * within * units.asDiagonal());
      found.covariance += share * (patch - mean) * (patch - mean).transpose();
    });
    found.patch.load = mean.head<kPatchLoads>();
    found.patch.place = {mean[4], mean[5], mean[6]};
  }
}

}  // namespace tractiond::solve

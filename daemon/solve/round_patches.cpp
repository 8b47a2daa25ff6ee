#include "daemon/solve/round_patches.h"

#include <algorithm>
#include <cmath>

namespace tractiond::solve {
namespace {

using Eigen::Index;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// The fit begins with the maxima of at least this share of the highest one's pressure.
constexpr double kStrong = 0.1;
/// Fainter ones that are tried in vain, at most; and how far from the edge of a patch, an even disc, they must be
/// [pitches].
constexpr int kTries = 2;
constexpr double kBeside = 1.5;
/// Distance around a patch within which the field tells whether it is long, and the difference of the variances of the
/// field's places along and across from which on it may be two [pitches, pitches^2].
constexpr double kAround = 3.5, kLong = 0.25;
/// Patches farther from each other than this are two contacts [pitches].
constexpr double kNear = 5.5;
/// A straight contact in place of two patches may leave so many squared deviations more, and, as its shape is not that
/// of a bar, this share of all displacements.
constexpr double kBarMisfit = 16.0, kMisfitOfShape = 0.005;
/// A bar as long as this has the same variance as two points at a distance of 1.
constexpr double kBarLength = 1.73;

/// Returns the radius of an even disc with the spread of a patch.
double radius(const PatchPlace& place) {
  return 2.0 * std::sqrt(std::max(place.spread_m2, 0.0));
}

}  // namespace

RoundPatches::RoundPatches(const sensor::Sensor& sensor, const Atoms& atoms, const Factors& factors)
    : atoms_(atoms)
    , factors_(factors)
    , influence_(sensor, atoms, factors)
    , spread_(atoms, atoms.pitch_m)
    , force_(atoms.pointCount())
    , height_(atoms.pointCount())
    , motion_(kMotions * influence_.stride())
    , here_(influence_.stride())
    , spot_(kPatchLoads * influence_.stride()) {
  maxima_.reserve(atoms.pointCount());
  for (Fit* fit : {&now_, &next_, &kept_, &pair_}) {
    fit->columns = LineArray<double>(kPatchLoads * kMost * influence_.stride());
    fit->left = LineArray<double>(influence_.stride());
    fit->slopes = LineArray<double>(kPatchPlaces * kMost * influence_.stride());
  }
}

bool RoundPatches::find(const Displacements& picture, std::span<const double> forces_N, double enough) {
  if (!findMaxima(forces_N)) return false;
  takeMotion(picture);
  if (!descend(picture)) return false;
  dropUnlikely(picture);
  areTwo_.fill(false);
  // What one more patch must gain of the misfit to be worth looking for.
  const double least = 2.0 * (kLeastGain + std::log(atoms_.nodeCount()));
  if (areNarrow()) addLikely(picture, enough + least);
  split(picture, enough + least);  // two that are one maximum make a broad patch
  return areNarrow();
}

bool RoundPatches::findOne(const Displacements& picture, const Vector3d& start, double enough) {
  count_ = 1;
  now_.patches[0].place = startAt(start);
  takeMotion(picture);
  return descend(picture, enough) && areNarrow() && now_.misfit <= enough;
}

/// Returns whether no patch, but for one, is too broad.
bool RoundPatches::areNarrow(int but) const {
  for (int k = 0; k < count_; ++k) {
    const double spread_m2 = now_.patches[k].place.spread_m2;
    if (k != but && spread_m2 >= kWidest * square(atoms_.pitch_m)) return false;
  }
  return true;
}

/// Begins with a patch at every strong maximum of the pressure, but for a single one at the centre of all forces.
/// False: there are none, or too many.
bool RoundPatches::findMaxima(std::span<const double> forces_N) {
  for (Index p = 0; p < force_.size(); ++p) force_[p] = Vector3d::Map(forces_N.data() + 3 * p).norm();
  spread_.average(force_, height_);
  const double highest = height_.maxCoeff();
  count_ = 0;
  maxima_.clear();
  if (!(highest > 0.0)) return false;
  for (int point = 0; point < atoms_.pointCount(); ++point) {
    bool isMaximum = height_[point] > 0.0;
    eachAround(point, atoms_.columns, atoms_.rows,
               [&](int other) { isMaximum = isMaximum && height_[other] <= height_[point]; });
    if (isMaximum) maxima_.push_back(point);
  }
  std::sort(maxima_.begin(), maxima_.end(),
            [this](int a, int b) { return height_[a] != height_[b] ? height_[a] > height_[b] : a < b; });
  for (const int point : maxima_) {
    if (height_[point] < kStrong * highest) break;
    if (count_ == kMost) return false;
    now_.patches[count_++].place = startAt(atoms_.points.col(point));
  }
  if (count_ == 1) now_.patches[0].place = startAt(atoms_.points * force_ / force_.sum());
  return true;
}

PatchPlace RoundPatches::startAt(const Vector3d& place) const {
  return {place.x(), place.y(), kSpread * square(atoms_.pitch_m)};
}

/// Fits other patches, which `change` makes from those that were found, kept_. Keeps them if they are more likely, and
/// if `fits`.
template <typename Change, typename Fits>
bool RoundPatches::isLikelier(const Displacements& picture, Change change, Fits fits) {
  const double before = logEvidence();
  const int count = count_;
  std::swap(now_, kept_);
  now_.patches = kept_.patches;
  change();
  if (descend(picture, mostMisfit(before)) && logEvidence() > before && fits()) return true;
  std::swap(now_, kept_);
  count_ = count;
  return false;
}

/// Fits again without the least evident patch, as long as that is more likely: the field has maxima of its own where
/// the picture tells little, beyond the nodes for example.
void RoundPatches::dropUnlikely(const Displacements& picture) {
  while (count_ > 1) {
    const int least = leastEvident();
    const auto drop = [&] {
      std::copy(kept_.patches.begin() + least + 1, kept_.patches.begin() + count_, now_.patches.begin() + least);
      --count_;
    };
    if (!isLikelier(picture, drop, [] { return true; })) return;
  }
}

/// Fits again with a patch at a fainter maximum, the highest ones first, and keeps it if that is more likely.
void RoundPatches::addLikely(const Displacements& picture, double enough) {
  int inVain = 0;
  for (const int point : maxima_) {
    if (inVain == kTries || count_ == kMost || now_.misfit <= enough) return;
    const auto found = patches();
    const bool isNear = std::any_of(found.begin(), found.end(), [&](const RoundPatch& patch) {
      const Vector2d away = atoms_.points.col(point).head<2>() - Vector2d(patch.place.x_m, patch.place.y_m);
      return away.norm() < radius(patch.place) + kBeside * atoms_.pitch_m;
    });
    if (isNear) continue;
    const auto add = [&] { now_.patches[count_++].place = startAt(atoms_.points.col(point)); };
    if (!isLikelier(picture, add, [this] { return areNarrow(); })) ++inVain;
  }
}

/// Fits two patches in place of one where the field is long, and keeps them if they are more likely and two contacts.
/// Beside another broad patch it does not try: that would stay one.
void RoundPatches::split(const Displacements& picture, double enough) {
  for (int k = 0; k < count_ && count_ < kMost && now_.misfit > enough; ++k) {
    if (!areNarrow(k)) continue;
    const Vector2d half = halfLength(k);
    if (half.isZero(0.0)) continue;
    const int other = count_;
    const auto divide = [&] {
      const PatchPlace& from = kept_.patches[k].place;
      now_.patches[k].place = startAt({from.x_m - half.x(), from.y_m - half.y(), 0.0});
      now_.patches[count_++].place = startAt({from.x_m + half.x(), from.y_m + half.y(), 0.0});
    };
    isLikelier(picture, divide, [&] { return areNarrow() && areTwoContacts(picture, k, other); });
  }
}

/// Returns half of the way between two points that make the field around a patch as long as it is; 0: it is not long.
Vector2d RoundPatches::halfLength(int patch) const {
  const PatchPlace& place = patches()[patch].place;
  const auto near = [&](Index p) {
    const Vector2d away = atoms_.points.col(p).head<2>() - Vector2d(place.x_m, place.y_m);
    return away.norm() < kAround * atoms_.pitch_m;
  };
  double sum = 0.0;
  Vector2d centre = Vector2d::Zero(), difference = Vector2d::Zero();  // of the variances, at twice the angle
  for (Index p = 0; p < force_.size(); ++p) {
    if (!near(p)) continue;
    sum += force_[p];
    centre += force_[p] * atoms_.points.col(p).head<2>();
  }
  if (sum == 0.0) return Vector2d::Zero();
  centre /= sum;
  for (Index p = 0; p < force_.size(); ++p) {
    if (!near(p)) continue;
    const Vector2d away = atoms_.points.col(p).head<2>() - centre;
    difference += force_[p] / sum * Vector2d(square(away.x()) - square(away.y()), 2.0 * away.x() * away.y());
  }
  const double longer = difference.norm();
  if (longer < kLong * square(atoms_.pitch_m)) return Vector2d::Zero();
  const double angle = 0.5 * std::atan2(difference.y(), difference.x());
  return std::sqrt(longer) * Vector2d(std::cos(angle), std::sin(angle));
}

/// Returns whether two patches are two contacts: they do not overlap, nor are they one straight contact.
bool RoundPatches::areTwoContacts(const Displacements& picture, int a, int b) {
  const PatchPlace &p = patches()[a].place, &q = patches()[b].place;
  const double distance = std::hypot(p.x_m - q.x_m, p.y_m - q.y_m);
  if (distance < radius(p) + radius(q)) return false;
  if (distance > kNear * atoms_.pitch_m) return true;
  bool& known = areTwo_[kMost * a + b];
  return known = known || !isBar(picture, a, b);
}

/// Returns whether a straight contact explains the picture as well as two patches.
bool RoundPatches::isBar(const Displacements& picture, int a, int b) {
  std::swap(now_, pair_);
  now_.patches = pair_.patches;
  PatchPlace &p = now_.patches[a].place, &q = now_.patches[b].place;
  const auto stretch = [](double& from, double& to) {
    const double middle = 0.5 * (from + to), half = 0.5 * kBarLength * (to - from);
    from = middle - half;
    to = middle + half;
  };
  stretch(p.x_m, q.x_m);
  stretch(p.y_m, q.y_m);
  const double most = pair_.misfit + kBarMisfit + square(kMisfitOfShape / picture.noise_px) * picture.squares_px2;
  bar_ = {a, b};
  const bool fits = descend(picture, most, most) && now_.misfit < most;
  bar_ = {-1, -1};
  std::swap(now_, pair_);
  return fits;
}

void RoundPatches::join(const Displacements& picture) {
  for (int k = 0; k < count_; ++k) contact_[k] = k;
  for (int b = 1; b < count_; ++b) {
    for (int a = 0; a < b; ++a) {
      const int one = contactOf(a), other = contactOf(b);
      if (one == other || areTwoContacts(picture, a, b)) continue;
      std::replace(contact_.begin(), contact_.begin() + count_, std::max(one, other), std::min(one, other));
    }
  }
}

}  // namespace tractiond::solve

#include "daemon/solve/contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tractiond::solve {
namespace {

/// Patches are tried where two hills are nearer than this [pitches], or where one is longer than wide: its greatest
/// variance less its smallest, and as a multiple of that [pitches^2]; and only if all displacements make so many
/// deviations of the noise.
constexpr double kNear = 5.5;
constexpr double kLong = 0.5, kLongForWidth = 0.5, kLongest = 9.0;
constexpr double kLoud_deviations = 100.0;

/// The patches' model itself is right to this share of the displacements, and, for two contacts against one that is
/// long, to the smaller one.
constexpr double kMisfit = 0.01, kMisfitOfShape = 0.005;

/// Two patches are two contacts if a bar leaves this much more, in squared deviations.
constexpr double kBarMisfit = 25.0;

/// A bar as long as this has the same variance as two points at a distance of 1.
constexpr double kBarLength = 1.73;

// A patch at the rim counts, from wholly to not at all, by its distance to the outermost nodes [pitches], by the surety
// of its hill and of the next best one [deviations], and by what it leaves more than the step, as a multiple of what
// its model and chance may.
constexpr std::array kRim = {2.0, 3.0};
constexpr std::array kFaint_deviations = {Hills::kLeast_deviations, 8.0};
constexpr std::array kRival_deviations = {3.0, Hills::kLeast_deviations};
constexpr std::array kRimMisfit = {1.0, 2.0};

/// Strength of the penalty around a patch, as a multiple of that around nothing.
constexpr double kRimStiffness = 10.0;

/// Continuous, 1 up to the first limit, 0 from the second on.
double fade(double x, const std::array<double, 2>& limits) {
  return std::clamp((limits[1] - x) / (limits[1] - limits[0]), 0.0, 1.0);
}

}  // namespace

Contacts::Contacts(const Inverse& inverse, const sensor::Sensor& sensor)
    : grid_(sensor.nodes)
    , positions_(sensor::nodePositions(sensor))
    , areas_(sensor::nodeAreas(sensor))
    , hills_({grid_.columns, grid_.rows, positions_, sensor::nodeNormals(sensor), areas_}, ContactStep::kMostNodes,
             ContactStep::kMostUnknowns)
    , fit_(inverse, sensor.nodes) {
  expected_.reserve(3 * ContactStep::kMostNodes);
  if (!sensor.body) offGrid_.emplace(sensor);
  nearly_ = LineArray<double>(static_cast<std::size_t>(inverse.influence.stride()));
}

Contacts::Hill Contacts::survey(const ContactStep& step, int hill) {
  const auto nodes = step.nodes();
  const auto forces = step.forces();
  const auto each = [&](auto use) {
    for (int i = 0; i < static_cast<int>(nodes.size()); ++i) {
      if (hills_.hillOf(i) != hill) continue;
      use(Eigen::Vector2d(nodes[i] % grid_.columns, nodes[i] / grid_.columns),
          Eigen::Vector3d::Map(forces.data() + 3 * i));
    }
  };
  Hill result;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  each([&](const auto&, const auto& force) { sum += force; });
  const double total = sum.norm();
  result.direction = sum / total;
  each([&](const auto& at, const auto& force) { result.centre += result.direction.dot(force) / total * at; });
  double sumOfVariances = 0.0;
  Eigen::Vector2d difference = Eigen::Vector2d::Zero();  // of the variances, as a vector at twice the angle
  each([&](const auto& at, const auto& force) {
    const Eigen::Vector2d d = at - result.centre;
    const double share = result.direction.dot(force) / total;
    sumOfVariances += share * d.squaredNorm();
    difference += share * Eigen::Vector2d(square(d.x()) - square(d.y()), 2.0 * d.x() * d.y());
  });
  const double longer = difference.norm(), width = 0.5 * (sumOfVariances - longer);
  if (longer > kLong + kLongForWidth * std::max(width, 0.0)) {
    const double angle = 0.5 * std::atan2(difference.y(), difference.x());
    result.half = std::sqrt(std::min(longer, kLongest)) * Eigen::Vector2d(std::cos(angle), std::sin(angle));
  }
  return result;
}

/// Whether patches `first` and the next are two contacts whose force is along `direction`: both press, and they do not
/// overlap. An even disc of variance v along either axis has the radius 2 sqrt(v).
bool Contacts::isPair(int first, const Eigen::Vector3d& direction) const {
  double reach = 0.0;
  for (int i = first; i < first + 2; ++i) {
    const Eigen::Matrix3d covariance = fit_.covariance(i).topLeftCorner<3, 3>();
    const double force = direction.dot(Eigen::Vector3d::Map(patches_[i].force_N.data()));
    if (force < Hills::kLeast_deviations * std::sqrt(direction.dot(covariance * direction))) return false;
    reach += 2.0 * std::sqrt(std::max(patches_[i].spread, 0.0));
  }
  return std::hypot(patches_[first + 1].column - patches_[first].column,
                    patches_[first + 1].row - patches_[first].row) > reach;
}

/// Explains the picture by patches: one for each hill, two for a long one if `split`. False: it is not explained, or a
/// long hill may as well be one contact.
bool Contacts::resolve(const ContactStep& step, const Picture& picture, std::span<const Hill> hills, bool split) {
  patchCount_ = 0;
  const auto isLong = [&](const Hill& hill) { return split && !hill.half.isZero(); };
  const auto add = [&](const Eigen::Vector2d& at) {
    patches_[patchCount_++] = {at.x(), at.y(), PatchFit::kSpread, {}};
  };
  for (const Hill& hill : hills) {
    if (patchCount_ + (isLong(hill) ? 2 : 1) > PatchFit::kMostPatches) return false;
    if (isLong(hill)) add(hill.centre - hill.half);
    add(isLong(hill) ? hill.centre + hill.half : hill.centre);
  }
  const std::span patches(patches_.data(), static_cast<std::size_t>(patchCount_));
  const double noise2 = square(picture.noise_px), signal = picture.squares_px2 / noise2;
  const double expected = step.squaredResidual() / noise2 + static_cast<double>(3 * step.nodes().size());
  if (!fit_.fit(patches, expected + square(kMisfit) * signal)) return false;
  int first = 0;
  for (const Hill& hill : hills) {
    if (isLong(hill) && !isPair(first, hill.direction)) return false;
    first += isLong(hill) ? 2 : 1;
  }

  const double most = fit_.chiSquared() + kBarMisfit + square(kMisfitOfShape) * signal;
  for (int i = 0; i < patchCount_; ++i) resolved_[i] = describe(patches_[i], fit_.covariance(i));
  first = 0;
  for (const Hill& hill : hills) {
    if (isLong(hill)) {
      auto ends = patches_;
      const auto stretch = [&](double Patch::*at) {
        const double middle = 0.5 * (patches_[first].*at + patches_[first + 1].*at);
        for (int i = first; i < first + 2; ++i) ends[i].*at = middle + kBarLength * (patches_[i].*at - middle);
      };
      stretch(&Patch::column);
      stretch(&Patch::row);
      if (fit_.fitsBar({ends.data(), patches.size()}, first, most)) return false;
    }
    first += isLong(hill) ? 2 : 1;
  }
  return true;
}

Contact Contacts::describe(const Patch& patch, const Eigen::Matrix<double, 6, 6>& covariance) const {
  Contact contact;
  contact.force_N = patch.force_N;
  for (int axis = 0; axis < 3; ++axis) contact.forceDeviation_N[axis] = std::sqrt(covariance(axis, axis));
  const Stencil stencil({patch.column, patch.row, 0.0, {}}, grid_.columns, grid_.rows);
  Eigen::Vector2d position = Eigen::Vector2d::Zero();
  Eigen::Matrix2d slope = Eigen::Matrix2d::Zero();  // of the position by column and row
  double area = 0.0;
  for (std::size_t i = 0; i < Stencil::kNodes; ++i) {
    const Eigen::Vector2d at = positions_.col(stencil.node[i]).head<2>();
    position += stencil.share[i][0] * at;
    slope += at * Eigen::RowVector2d(stencil.share[i][1], stencil.share[i][2]);
    area += stencil.share[i][0] * areas_[stencil.node[i]];
  }
  const Eigen::Matrix2d spread = slope * covariance.block<2, 2>(3, 3) * slope.transpose();
  for (int axis = 0; axis < 2; ++axis) {
    contact.position_m[axis] = position[axis];
    contact.positionDeviation_m[axis] = std::sqrt(spread(axis, axis));
  }
  contact.areaDeviation_m2 = 4.0 * M_PI * area * std::sqrt(covariance(5, 5));
  contact.area_m2 = std::max(4.0 * M_PI * area * patch.spread, contact.areaDeviation_m2);
  return contact;
}

/// Markers see a contact at the rim from one side: the nodes make up for its breadth by false forces, and noise is
/// several times that in the middle. A patch has its breadth as one number and its force as one vector; solved around
/// it, the nodes add what it lacks.
void Contacts::solveAtRim(ContactStep& step, const Picture& picture, const Hill& hill, double certainty) {
  const double toRim = std::min({hill.centre.x(), grid_.columns - 1 - hill.centre.x(),  //
                                 hill.centre.y(), grid_.rows - 1 - hill.centre.y()});
  double share = fade(toRim, kRim) * certainty;
  if (share == 0.0 || !offGrid_) return;
  Patch& patch = atRim_.patch;
  patch = {hill.centre.x(), hill.centre.y(), PatchFit::kSpread, {}};
  const double noise2 = square(picture.noise_px);
  const double expected = step.squaredResidual() / noise2 + static_cast<double>(3 * step.nodes().size());
  const double allowed = kBarMisfit + square(kMisfit) * picture.squares_px2 / noise2;
  const double most = expected + kRimMisfit[1] * allowed;
  fit_.begin(step, picture);
  // From the nodes' patch, the true one is a step or two away.
  if (!fit_.fit({&patch, 1}, std::numeric_limits<double>::infinity()) || !fit_.fit(patch, most, *offGrid_)) return;
  atRim_.covariance = fit_.covariance(0);
  share *= fade((fit_.chiSquared() - expected) / allowed, kRimMisfit);
  if (share == 0.0) return;

  const auto nodes = step.nodes();
  expected_.assign(3 * nodes.size(), 0.0);
  const Stencil stencil(patch, grid_.columns, grid_.rows);
  for (std::size_t i = 0; i < Stencil::kNodes; ++i) {
    const auto at = std::lower_bound(nodes.begin(), nodes.end(), stencil.node[i]);
    if (at == nodes.end() || *at != stencil.node[i]) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      expected_[3 * static_cast<std::size_t>(at - nodes.begin()) + axis] =
          share * stencil.share[i][0] * patch.force_N[axis];
    }
  }
  // What the nodes lack is taken out of the picture.
  const auto& [coordinates, difference] = offGrid_->of(patch, picture.missing);
  std::copy_n(picture.displacement_px, nearly_.size(), nearly_.data());
  for (std::size_t j = 0; j < coordinates.size(); ++j) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      nearly_.data()[coordinates[j]] -= share * difference[12 * j + 4 * axis] * patch.force_N[axis];
    }
  }
  const double squares = dotProduct(nearly_.data(), nearly_.data(), static_cast<int>(nearly_.size()));
  if (step.solve(nearly_.data(), picture.missing, squares, expected_, 1.0 + share * (kRimStiffness - 1.0))) {
    atRim_.share = share;
  } else {
    step.solve(picture.displacement_px, picture.missing, picture.squares_px2);
  }
}

int Contacts::list(ContactStep& step, const Picture& picture, double trust,
                   std::array<Contact, kMaxContacts>& contacts) {
  hills_.divide(step);
  atRim_.share = 0.0;
  std::array<Hill, PatchFit::kMostPatches> hills;
  int count = 0;
  int lone = 0;  // the last contact's hill
  bool isNear = false, isLong = false;
  double sure_deviations = 0.0, rival_deviations = 0.0;  // of the last contact; of the hill that is nearly one
  for (int hill = 0; hill < hills_.count(); ++hill) {
    if (!hills_.stands(hill) || count == kMaxContacts) continue;
    const Contact contact = hills_.describe(step, hill);
    const double deviations = Hills::surety(contact);
    if (!(deviations > Hills::kLeast_deviations)) {
      rival_deviations = std::max(rival_deviations, deviations);
      continue;
    }
    sure_deviations = deviations;
    lone = hill;
    if (count < PatchFit::kMostPatches) {
      hills[count] = survey(step, hill);
      isLong |= !hills[count].half.isZero();
      for (int other = 0; other < count; ++other) {
        isNear |= (hills[count].centre - hills[other].centre).norm() < kNear;
      }
    }
    contacts[count++] = contact;
  }
  const bool isLoud = picture.squares_px2 > square(kLoud_deviations * picture.noise_px);
  if (isLoud && (isNear || isLong) && count <= PatchFit::kMostPatches) {
    const std::span<const Hill> all(hills.data(), static_cast<std::size_t>(count));
    fit_.begin(step, picture);
    if ((isLong && resolve(step, picture, all, true)) || (isNear && resolve(step, picture, all, false))) {
      count = patchCount_;
      std::copy_n(resolved_.begin(), count, contacts.begin());
    }
  }
  if (count == 1) {
    const double certainty =
        trust * (1.0 - fade(sure_deviations, kFaint_deviations)) * fade(rival_deviations, kRival_deviations);
    solveAtRim(step, picture, hills[0], certainty);
    if (atRim_.share > 0.0) {
      contacts[0] = hills_.describe(step, lone);
      const Contact patch = describe(atRim_.patch, atRim_.covariance);
      const auto widen = [&](double& deviation, double other) {
        deviation = std::sqrt(square(deviation) + atRim_.share * square(other));
      };
      for (std::size_t i = 0; i < 3; ++i) widen(contacts[0].forceDeviation_N[i], patch.forceDeviation_N[i]);
      for (std::size_t i = 0; i < 2; ++i) widen(contacts[0].positionDeviation_m[i], patch.positionDeviation_m[i]);
      widen(contacts[0].areaDeviation_m2, patch.areaDeviation_m2);
    }
  }
  Hills::sort({contacts.data(), static_cast<std::size_t>(count)});
  return count;
}

}  // namespace tractiond::solve

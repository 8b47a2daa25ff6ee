// Per frame: the displacements' amplitudes in the singular vectors, c = U'd, streaming the rows of the markers used,
// with the missing ones completed. From them ContactStep sees where something touches, and solves for that. Where the
// contact is too large for it, or does not explain the picture, all nodes are solved for: f = V S^-1 G c. Between the
// two the result is a mean whose weights change continuously. To see where something touches, coarse numbers will do:
// while no marker is missing and the contact is small, a third of the bytes is streamed.
//
// The residual of the whole face needs no product of its own. With d completed by the values that leave the missing
// rows none,
//   (d - H f)' W (d - H f) = |d|^2 - |D^1/2 R'd|^2 - |c|^2 + |(1 - G) c|^2.
#include "daemon/solve/solver.h"

#include "daemon/solve/systematic.h"
#include "daemon/solve/wrench.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace tractiond::solve {
namespace {

/// The contact step explains the picture if what it leaves is the noise, a tenth more, and so much of the
/// displacements.
constexpr double kExplained_noise = 0.1;
constexpr double kExplained_share = 0.02;

/// Share of the force on the outermost nodes that is in doubt: flat discs that reach beyond them are misread by 2 to 18
/// % of it.
constexpr double kDoubtAtRim = 0.08;

}  // namespace

Solver::Solver(const Inverse& inverse, const sensor::Sensor& sensor, const SolveOptions& options)
    : inverse_(inverse)
    , options_(options)
    , uncertainty_(sensor.uncertainty)
    , pitch_m_(sensor.nodes.pitch)
    , columns_(sensor.nodes.columns)
    , rules_(sensor, options)
    , nodes_(rules_.nodes())
    , missing_(inverse)
    , contact_(inverse, sensor.nodes, options)
    , contacts_(inverse, sensor)
    , everyMode_(static_cast<std::size_t>(inverse.rank()))
    , coarseLeft_(inverse.left, inverse.coordinateCount(), contact_.modes())
    , coarseSum_(static_cast<std::size_t>(coarseLeft_.stride()))
    , nodeNoise_(static_cast<std::size_t>(inverse.forceCount()), 0.0)
    , nodeShrinkage_(static_cast<std::size_t>(inverse.forceCount()), 1.0)
    , used_(inverse.coordinateCount() / 2, options)
    , amplitudes_(static_cast<std::size_t>(inverse.left.stride()))
    , filtered_(1, inverse.left.columns())
    , restored_(static_cast<std::size_t>(inverse.coordinateCount()))
    , restoredFloat_(static_cast<std::size_t>(inverse.coordinateCount()))
    , forces_(static_cast<std::size_t>(inverse.right.stride()))
    , functionals_(static_cast<std::size_t>(kColumns * ContactStep::kMostUnknowns))
    , deviations_(3 * ContactStep::kMostNodes) {
  assert(3 * static_cast<int>(nodes_.size()) == inverse.forceCount() &&
         static_cast<int>(used_.row_px().size()) == inverse.influence.stride());
  for (const double s : inverse.singularValues) {
    gain_.push_back(square(s) / (square(s) + square(inverse.lambda)));
    inverted_.push_back(gain_.back() / s);
  }
  gain_.insert(gain_.end(), inverse.motionGain.begin(), inverse.motionGain.end());
  std::iota(everyMode_.begin(), everyMode_.end(), 0);

  // Noise: V S^-1 G (V S^-1 G)'. Shrinkage, what the penalty keeps from forces of 1 N: (1 - V G V')^2.
  const auto add = [](WrenchCovariance& sum, double factor, const std::array<double, 6>& w) {
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) sum[6 * i + j] += factor * w[i] * w[j];
    }
  };
  for (const auto& at : nodes_) {
    for (int axis = 0; axis < 3; ++axis) add(wholeShrinkage_, 1.0, wrenchRow(at, axis));
  }
  for (int k = 0; k < inverse.rank(); ++k) {
    const float* const v = inverse.right.row(k);
    const double kept = gain_[k] * (2.0 - gain_[k]);
    std::array<double, 6> wrench{};
    for (int i = 0; i < inverse.forceCount(); ++i) {
      nodeNoise_[i] += square(inverted_[k] * v[i]);
      nodeShrinkage_[i] -= kept * square(v[i]);
      const auto row = wrenchRow(nodes_[i / 3], i % 3);
      for (int j = 0; j < 6; ++j) wrench[j] += row[j] * v[i];
    }
    add(wholeNoise_, square(inverted_[k]), wrench);
    add(wholeShrinkage_, -kept, wrench);
  }
}

void Solver::solve(const MarkerField& markers, TractionField& field) noexcept {
  assert(2 * markers.valid.size() == static_cast<std::size_t>(inverse_.coordinateCount()));
  assert(markers.displacement_px.size() == static_cast<std::size_t>(inverse_.coordinateCount()));
  assert(field.markers.valid.size() == markers.valid.size());
  assert(field.force_N.size() == static_cast<std::size_t>(inverse_.forceCount()));
  field.markers = markers;
  field.flags = markers.flags;
  FieldRules::clear(field);
  if ((markers.flags & kGelMismatch) != 0) return;  // numbers of another gel
  if ((markers.flags & kFewMarkers) != 0 || !used_.take(markers) || !missing_.update(used_.used())) {
    field.flags |= kFewMarkers;
    counters_.fewMarkers.add();
    return;
  }
  noise_px_ = used_.noise_px();
  squares_ = used_.squares_px2();
  const bool coarse = options_.contactAware && missing_.coordinates().empty();
  if (coarse) {
    decomposeCoarsely();
  } else {
    decompose();
  }

  double share = 0.0;  // of the contact step in the result
  if (options_.contactAware) {
    share = contact_.find(amplitudes_, noise_px_);
    if (share > 0.0 && !contact_.solve(used_.row_px().data(), missing_.coordinates(), squares_)) share = 0.0;
    if (share > 0.0) {
      const auto count = static_cast<double>(used_.coordinates().size());
      const double excess = contact_.squaredResidual() / count - square(noise_px_);
      const double explained = kExplained_noise * square(noise_px_) + square(kExplained_share) * squares_ / count;
      share *= 1.0 - std::clamp((excess / explained - 1.0), 0.0, 1.0);
    }
  }
  if (share < 1.0) {
    if (coarse) decompose();
    fitWholeFace();
    counters_.wholeFace.add();
  }
  combine(share, field);
  if (!std::isfinite(squares_) || !FieldRules::finite(field)) {
    FieldRules::clear(field);
    field.flags = markers.flags;
    counters_.notFinite.add();
  }
}

void Solver::decompose() {
  std::fill(amplitudes_.begin(), amplitudes_.end(), 0.0);
  addRows(inverse_.left, used_.coordinates(), used_.displacements_px(), amplitudes_.data());
  restoredSquares_ = 0.0;
  const auto missing = missing_.coordinates();
  if (missing.empty()) return;
  float* const filtered = filtered_.row(0);
  for (std::size_t i = 0; i < gain_.size(); ++i) filtered[i] = static_cast<float>(gain_[i] * amplitudes_[i]);
  multiplyRows(inverse_.left, missing, filtered, restored_.data());
  missing_.solve(restored_.data());
  for (std::size_t i = 0; i < missing.size(); ++i) {
    restoredFloat_[i] = static_cast<float>(restored_[i]);
    restoredSquares_ += square(restored_[i]);
  }
  addRows(inverse_.left, missing, {restoredFloat_.data(), missing.size()}, amplitudes_.data());
}

/// The first amplitudes alone, for contact_.
void Solver::decomposeCoarsely() {
  std::fill_n(coarseSum_.data(), coarseSum_.size(), 0.0F);
  addRows(coarseLeft_, used_.coordinates(), used_.displacements_px(), coarseSum_.data());
  std::copy_n(coarseSum_.data(), coarseSum_.size(), amplitudes_.begin());
}

void Solver::fitWholeFace() {
  float* const filtered = filtered_.row(0);
  for (std::size_t i = 0; i < everyMode_.size(); ++i) filtered[i] = static_cast<float>(inverted_[i] * amplitudes_[i]);
  std::fill(forces_.begin(), forces_.end(), 0.0);
  addRows(inverse_.right, everyMode_, {filtered, everyMode_.size()}, forces_.data());
}

void Solver::combine(double share, TractionField& field) {
  const double whole = 1.0 - share;
  double squaredResidual = 0.0;
  if (whole > 0.0) {
    double squares = squares_ + restoredSquares_, forces = 0.0;
    const std::size_t rank = everyMode_.size();
    for (std::size_t i = 0; i < gain_.size(); ++i) {
      squares += square(amplitudes_[i]) * (i < rank ? square(1.0 - gain_[i]) - 1.0 : -gain_[i]);
    }
    squaredResidual += whole * squares;
    for (std::size_t i = 0; i < field.force_N.size(); ++i) {
      field.force_N[i] = static_cast<float>(whole * forces_[i]);
      forces += square(forces_[i]);
    }
    const double typical = forces / static_cast<double>(field.force_N.size());
    const double noise = square(noise_px_) * static_cast<double>(inverse_.coordinateCount()) /
                         static_cast<double>(used_.coordinates().size());
    for (std::size_t i = 0; i < field.noise.size(); ++i) {
      field.noise[i] = whole * (noise * wholeNoise_[i] + typical * wholeShrinkage_[i]);
    }
    for (std::size_t i = 0; i < field.deviation_N.size(); ++i) {
      field.deviation_N[i] = static_cast<float>(whole * std::sqrt(noise * nodeNoise_[i] + typical * nodeShrinkage_[i]));
    }
    field.strength = inverse_.lambda;
  }
  if (share > 0.0) {
    if (share >= 0.5) {
      field.contactCount =
          contacts_.list(contact_, {used_.row_px().data(), missing_.coordinates(), squares_, noise_px_},
                         2.0 * share - 1.0, field.contacts);
      field.strength = contact_.lambda();
    }
    field.pictureMotion = contact_.motion();
    squaredResidual += share * contact_.squaredResidual();
    addNodes(share, field);
    if (share >= 0.5) addNoiseOfPatch(share, contacts_.atRim(), field);
    if (contact_.nodes().empty() && share == 1.0) {  // what lies below the limit is not seen
      const auto limit = contact_.detectionLimit_N();
      for (const int axis : {0, 1, 2}) field.noise[7 * axis] = square(0.5 * limit[axis / 2]);
    }
  }
  field.method = share == 1.0  ? (contact_.nodes().empty() ? Method::kNoContact : Method::kContact)
                 : share > 0.0 ? Method::kBlend
                               : Method::kWholeFace;
  field.valid = true;
  sum(field);
  field.systematic = systematicCovariance(wrenchOf(field), rules_.centroid(field), uncertainty_, pitch_m_,
                                          inverse_.systematicErrors, whole);
  addDoubtAtRim(share, field);
  judge(squaredResidual, field);
}

/// Adds what the contact step found. The spread of a mean is at most the mean of the spreads' squares.
void Solver::addNodes(double share, TractionField& field) {
  const auto nodes = contact_.nodes();
  const auto forces = contact_.forces();
  contact_.deviations(deviations_.data());
  for (std::size_t i = 0; i < forces.size(); ++i) {
    const std::size_t at = 3 * static_cast<std::size_t>(nodes[i / 3]) + i % 3;
    field.force_N[at] += static_cast<float>(share * forces[i]);
    field.deviation_N[at] += static_cast<float>(share * deviations_[i]);
    const auto row = wrenchRow(nodes_[nodes[i / 3]], static_cast<int>(i % 3));
    std::copy(row.begin(), row.end(), functionals_.data() + kColumns * i);
  }
  std::array<double, kColumns * kColumns> covariances{};
  contact_.covariances(functionals_.data(), covariances);
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) field.noise[6 * i + j] += share * covariances[kColumns * i + j];
  }
}

/// Adds that of the patch that the contact step was solved around, as far as its nodes know no better: by the share of
/// a deviation that the picture left of what was expected of the strongest one.
void Solver::addNoiseOfPatch(double share, const Contacts::AtRim& found, TractionField& field) const {
  share *= found.share;
  if (share == 0.0) return;
  using Matrix = Eigen::Matrix<double, 6, 6>;
  using Vector = Eigen::Matrix<double, 6, 1>;
  Matrix wrench = Matrix::Zero();  // by the patch's force, place and spread
  const Stencil stencil(found.patch, columns_, static_cast<int>(nodes_.size()) / columns_);
  const auto strongest = static_cast<std::size_t>(
      std::max_element(stencil.share.begin(), stencil.share.end(), [](auto& a, auto& b) { return a[0] < b[0]; }) -
      stencil.share.begin());
  const auto at = static_cast<std::size_t>(stencil.node[strongest]);
  const double before = noise_px_ / contact_.lambda() * contact_.weights()[at];
  if (!(before > 0.0)) return;
  double left = 0.0;
  for (std::size_t axis = 0; axis < 3; ++axis) left += square(field.deviation_N[3 * at + axis] / before) / 3.0;
  share *= std::min(std::sqrt(left), 1.0);
  for (std::size_t i = 0; i < Stencil::kNodes; ++i) {
    const auto node = static_cast<std::size_t>(stencil.node[i]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto& shares = stencil.share[i];
      Vector slope = Vector::Zero();
      slope[static_cast<Eigen::Index>(axis)] = shares[0];
      slope.tail<3>() = found.patch.force_N[axis] * Eigen::Vector3d(shares[1], shares[2], shares[3]);
      float& deviation = field.deviation_N[3 * node + axis];
      deviation = static_cast<float>(std::sqrt(square(deviation) + share * slope.dot(found.covariance * slope)));
      wrench += Vector::Map(wrenchRow(nodes_[node], static_cast<int>(axis)).data()) * slope.transpose();
    }
  }
  const Matrix covariance = wrench * found.covariance * wrench.transpose();
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) field.noise[6 * i + j] += share * covariance(i, j);
  }
}

/// A contact may reach beyond the outermost nodes, which then stand for what lies there; unless it is a patch.
void Solver::addDoubtAtRim(double share, TractionField& field) const {
  if (share >= 0.5) share *= 1.0 - contacts_.atRim().share;
  const int rows = static_cast<int>(nodes_.size()) / columns_;
  const auto eachOutermost = [&](auto use) {
    for (const int node : contact_.nodes()) {
      const int row = node / columns_, column = node % columns_;
      if (std::min(row, column) > 0 && row < rows - 1 && column < columns_ - 1) continue;
      const float* const f = field.force_N.data() + 3 * node;
      use(node, std::sqrt(square(f[0]) + square(f[1]) + square(f[2])));
    }
  };
  double force = 0.0;
  eachOutermost([&](int, double magnitude) { force += magnitude; });
  eachOutermost([&](int node, double magnitude) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto row = wrenchRow(nodes_[static_cast<std::size_t>(node)], axis);
      for (std::size_t i = 0; i < 36; ++i) {
        field.systematic[i] += share * square(kDoubtAtRim) * force * magnitude * row[i / 6] * row[i % 6];
      }
    }
  });
}

void Solver::sum(TractionField& field) const {
  std::array<double, 3> resultant{}, moment{};
  for (std::size_t node = 0; node < nodes_.size(); ++node) {
    const auto [x, y, z] = nodes_[node];
    const double fx = field.force_N[3 * node], fy = field.force_N[3 * node + 1], fz = field.force_N[3 * node + 2];
    resultant[0] += fx;
    resultant[1] += fy;
    resultant[2] += fz;
    moment[0] += y * fz - z * fy;
    moment[1] += z * fx - x * fz;
    moment[2] += x * fy - y * fx;
  }
  field.resultant_N = resultant;
  field.moment_Nm = moment;
  rules_.centre(field);
}

void Solver::judge(double squaredResidual, TractionField& field) const {
  FieldRules::explain(squaredResidual, used_, field);
  for (std::size_t i = 0; i < field.force_N.size(); i += 3) {
    const double force = square(field.force_N[i]) + square(field.force_N[i + 1]) + square(field.force_N[i + 2]);
    if (!rules_.outOfRange(i / 3, force)) continue;
    field.flags |= kOutOfRange;
    break;
  }
}

}  // namespace tractiond::solve

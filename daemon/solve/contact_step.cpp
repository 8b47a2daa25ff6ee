// Two maps of the forces, Tikhonov's with two strengths. The stronger one is nearly a matched filter: it finds the
// weakest touch, but blurs it over many nodes. The other shows the outline of contacts that are strong enough for it.
// In either, a node belongs to a contact if it is not far below the strongest one near it, which sets side lobes and
// noise aside, and if that one is neither noise nor a side lobe of a far stronger contact.
#include "daemon/solve/contact_step.h"

#include <Eigen/LU>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>
#include <numeric>

namespace tractiond::solve {
namespace {

/// Nodes that belong to the same contact as a stronger one are no farther from it, in pitches.
constexpr double kReach = 4.3;

/// A mode counts in a map while its singular value is above this share of the map's strength. Outlines are drawn from
/// far stronger forces than the weakest touch, and do with fewer.
constexpr double kFaintestInTouch = 0.1, kFaintestInShape = 0.3;

/// Continuous, 0 up to `low`, 1 from `high` on.
double ramp(double x, double low, double high) {
  return std::clamp((x - low) / (high - low), 0.0, 1.0);
}

// What the weights rest on. Surety is the length of a node's force in standard deviations: among all nodes of an
// untouched gel it exceeds 5 in one frame of a hundred.
constexpr std::array kSure = {5.0, 7.0};         // of the strongest nearby: is anything there?
constexpr std::array kSureNode = {3.25, 4.25};   // of the node itself
constexpr std::array kOutline = {0.15, 0.3};     // of the strongest nearby: the edge of a contact
constexpr std::array kNoSideLobe = {0.1, 0.16};  // of the strongest of all: side lobes stay below 0.1
constexpr std::array kTouchOutline = {0.5, 0.7};

/// The touch map's outline may be lower by so much, as long as no more nodes than these are above it: the edge of a
/// wide press counts.
constexpr double kTouchWider = 0.2;
constexpr std::ptrdiff_t kTouchNodesWide = 54;

constexpr std::array kNoTouchSideLobe = {0.2, 0.4};
constexpr std::array kOutlineSeen = {6.0, 10.0};  // surety in the shape map from which it is the better one

/// Force of a contact's nodes as a multiple of the shape map's strongest: for touches and outlines of a few nodes, for
/// those of many, and the number of nodes for which it is 1.
constexpr double kTouchPoint = 2.0, kPoint = 4.0, kPlane = 0.2, kTouchNodes = 24.0, kNodes = 36.0;

/// Contacts of so many nodes: of fewer, the map shows the profile, of more, no more than the outline.
constexpr std::array kCompact = {30.0, 50.0};

/// A node of so much weight, 1 / kFull, counts as one.
constexpr double kFull = 4.0;

/// Of a node with a smaller weight less is expected.
constexpr double kLeastScale = 0.05;

double ramp(double x, const std::array<double, 2>& limits) {
  return ramp(x, limits[0], limits[1]);
}

}  // namespace

ContactStep::ContactStep(const Inverse& inverse, const sensor::NodeGrid& nodes, const SolveOptions& options)
    : inverse_(inverse)
    , options_(options)
    , columns_(nodes.columns)
    , rows_(nodes.rows)
    , touch_(makeMap(options.touchForce_N, kFaintestInTouch))
    , shape_(makeMap(options.shapeForce_N, kFaintestInShape))
    , modeForces_(inverse.right, std::max(touch_.modes, shape_.modes), inverse.forceCount())
    , everyMode_(static_cast<std::size_t>(modeForces_.rows()))
    , coefficients_(everyMode_.size())
    , sum_(static_cast<std::size_t>(modeForces_.stride())) {
  assert(3 * nodes.count() == inverse.forceCount());
  std::iota(everyMode_.begin(), everyMode_.end(), 0);

  const auto stride = static_cast<std::size_t>(inverse.influence.stride());
  motionModes_.assign(kMotions * stride, 0.0);
  for (int k = 0; k < kMotions; ++k) {
    std::copy_n(inverse.motion.row(k), stride, motionModes_.begin() + static_cast<std::ptrdiff_t>(k * stride));
  }
  const std::array<int, kMotions> everyMotion = {0, 1, 2, 3};
  motionGram_.resize(kMotions * kMotions);
  std::vector<int> everyForce(static_cast<std::size_t>(inverse.forceCount()));
  std::iota(everyForce.begin(), everyForce.end(), 0);
  std::vector<double> column(everyForce.size());
  motionCoupling_.resize(kMotions * everyForce.size());
  for (int k = 0; k < kMotions; ++k) {
    const double* const mode = motionModes_.data() + static_cast<std::ptrdiff_t>(k) * inverse.influence.stride();
    multiplyRows(inverse.motion, everyMotion, mode, motionGram_.data() + k * kMotions);
    multiplyRows(inverse.influence, everyForce, mode, column.data());
    for (std::size_t i = 0; i < column.size(); ++i) motionCoupling_[i * kMotions + k] = column[i];
  }

  const auto all = static_cast<std::size_t>(nodes.count());
  for (auto* each :
       {&touchSurety_, &shapeSurety_, &magnitude_, &strongNear_, &weight_, &faintness_, &touchShare_, &counted_})
    each->resize(all);
  nodes_.reserve(all);
  constexpr std::size_t kUnknowns = kMostUnknowns;
  unknowns_.reserve(kUnknowns);
  scale_.reserve(kUnknowns);
  matrix_.resize(kUnknowns * (kUnknowns + 1) / 2);
  for (auto* each : {&right_, &solution_, &prior_, &variances_}) each->resize(kUnknowns);
  scratch_ = LineArray<double>(kColumns * kUnknowns);
  forces_.resize(3 * kMostNodes);
  missingRows_.resize(kUnknowns * static_cast<std::size_t>(inverse.coordinateCount()));
  detectionLimit_N_ = detectionLimit();
}

ContactStep::Map ContactStep::makeMap(double force_N, double faintest) const {
  const double strength = options_.noise_px / force_N;
  Map map;
  for (const double s : inverse_.singularValues) {
    if (s < faintest * strength && map.modes > 0) break;
    map.filter.push_back(s / (square(s) + square(strength)));
    ++map.modes;
  }
  map.force.resize(static_cast<std::size_t>(inverse_.right.stride()));
  for (int node = 0; node < inverse_.forceCount() / 3; ++node) {
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // at 1 px of noise
    for (int k = 0; k < map.modes; ++k) {
      const Eigen::Vector3d v = Eigen::Vector3f::Map(inverse_.right.row(k) + 3 * node).cast<double>();
      covariance += square(map.filter[k]) * v * v.transpose();
    }
    const Eigen::Matrix3d precision = covariance.inverse();
    for (const auto& [i, j] : {std::pair{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}) {
      map.precision.push_back(precision(i, j));
    }
  }
  return map;
}

std::array<double, 2> ContactStep::detectionLimit() const {
  std::array<std::vector<double>, 2> surety;  // of 1 N at each node, along x and z
  std::vector<double> response(touch_.force.size()), answer(touch_.force.size() / 3);
  for (int node = 0; node < inverse_.forceCount() / 3; ++node) {
    for (const int axis : {0, 2}) {
      Eigen::Vector3d force = Eigen::Vector3d::Zero();
      for (int k = 0; k < touch_.modes; ++k) {
        const Eigen::Vector3d v = Eigen::Vector3f::Map(inverse_.right.row(k) + 3 * node).cast<double>();
        force += touch_.filter[k] * inverse_.singularValues[k] * v[axis] * v;
      }
      surety[axis / 2].push_back(length(force.data(), touch_.precision.data() + 6 * node) / options_.noise_px);
    }
  }
  std::array<double, 2> limit{};
  for (int i = 0; i < 2; ++i) {
    const auto median = surety[i].begin() + static_cast<std::ptrdiff_t>(surety[i].size() / 2);
    std::nth_element(surety[i].begin(), median, surety[i].end());
    limit[i] = kSure[0] / *median;
  }
  return limit;
}

double ContactStep::find(std::span<const double> amplitudes, double noise_px) {
  noise_px_ = noise_px;
  filter(shape_, amplitudes);
  surety(shape_, shapeSurety_);
  if (*std::max_element(shapeSurety_.begin(), shapeSurety_.end()) < kOutlineSeen[1]) {  // else nobody asks for it
    filter(touch_, amplitudes);
    surety(touch_, touchSurety_);
  }
  for (std::size_t node = 0; node < magnitude_.size(); ++node) {
    const double* const f = shape_.force.data() + 3 * node;
    magnitude_[node] = std::sqrt(square(f[0]) + square(f[1]) + square(f[2]));
  }
  weigh();

  nodes_.clear();
  double few = 0.0;
  for (std::size_t node = 0; node < weight_.size(); ++node) {
    if (!(weight_[node] > 0.0)) continue;
    nodes_.push_back(static_cast<int>(node));
    few += std::min(1.0, kFull * weight_[node]);
  }
  // To expect little of a contact's faint nodes, and much of the others, costs its sum neither noise nor force.
  const double compact = 1.0 - ramp(few, kCompact);
  for (const int node : nodes_) weight_[node] -= compact * faintness_[node];
  // The map shows a point with a sixth of its force and a plane with all of it.
  expected_N_ *= outlined_ * std::clamp(square(kNodes / few), kPlane, kPoint) +
                 (1.0 - outlined_) * std::clamp(kTouchNodes / few, kPlane, kTouchPoint);
  expected_N_ = std::max(expected_N_, options_.forceScale_N);
  if (nodes_.size() > kMostNodes) return 0.0;
  return 1.0 - ramp(few, kFewNodes, kMostNodes - 8);
}

void ContactStep::filter(Map& map, std::span<const double> amplitudes) {
  for (int k = 0; k < map.modes; ++k) coefficients_[k] = static_cast<float>(map.filter[k] * amplitudes[k]);
  const auto modes = static_cast<std::size_t>(map.modes);
  std::fill_n(sum_.data(), sum_.size(), 0.0F);
  addRows(modeForces_, std::span(everyMode_).first(modes), std::span(coefficients_).first(modes), sum_.data());
  std::copy_n(sum_.data(), sum_.size(), map.force.begin());
}

double ContactStep::length(const double* f, const double* precision) {
  return std::sqrt(f[0] * f[0] * precision[0] + f[1] * f[1] * precision[1] + f[2] * f[2] * precision[2] +
                   2.0 * (f[0] * f[1] * precision[3] + f[0] * f[2] * precision[4] + f[1] * f[2] * precision[5]));
}

void ContactStep::surety(const Map& map, std::vector<double>& result) const {
  for (std::size_t node = 0; node < result.size(); ++node) {
    result[node] = length(map.force.data() + 3 * node, map.precision.data() + 6 * node) / noise_px_;
  }
}

void ContactStep::weigh() {
  const double surest = *std::max_element(shapeSurety_.begin(), shapeSurety_.end());
  const double strongest = *std::max_element(magnitude_.begin(), magnitude_.end());
  const double surestTouch = *std::max_element(touchSurety_.begin(), touchSurety_.end());
  outlined_ = ramp(surest, kOutlineSeen);
  expected_N_ = strongest;

  constexpr int kRows = static_cast<int>(kReach);
  const auto nearest = [&](int node, auto use) {
    const int row = node / columns_, column = node % columns_;
    for (int r = std::max(0, row - kRows); r <= std::min(rows_ - 1, row + kRows); ++r) {
      const int reach = static_cast<int>(std::sqrt(square(kReach) - square(r - row)));
      const int last = std::min(columns_ - 1, column + reach);
      for (int c = std::max(0, column - reach); c <= last; ++c) use(r * columns_ + c);
    }
  };
  std::fill(strongNear_.begin(), strongNear_.end(), 0.0);  // of those nearby that are no side lobes
  for (int node = 0; node < columns_ * rows_ && outlined_ > 0.0; ++node) {
    const double strong = magnitude_[node];
    if (strong <= kNoSideLobe[0] * strongest) continue;
    nearest(node, [&](int other) { strongNear_[other] = std::max(strongNear_[other], strong); });
  }
  double wider = 0.0;
  if (outlined_ < 1.0) {
    for (int node = 0; node < columns_ * rows_; ++node) {
      touchShare_[node] = counted_[node] = 0.0;  // share: of the surest nearby
      if (touchSurety_[node] <= std::max(kSure[0], kNoTouchSideLobe[0] * surestTouch)) continue;
      double sure = 0.0;
      nearest(node, [&](int other) { sure = std::max(sure, touchSurety_[other]); });
      touchShare_[node] = touchSurety_[node] / sure;
      counted_[node] =
          touchShare_[node] * std::min(1.0, kFull * ramp(touchSurety_[node] / surestTouch, kNoTouchSideLobe) *
                                                ramp(touchSurety_[node], kSure));
    }
    const auto next = counted_.begin() + std::min<std::ptrdiff_t>(kTouchNodesWide, std::ssize(counted_) - 1);
    std::nth_element(counted_.begin(), next, counted_.end(), std::greater());
    wider = std::clamp(kTouchOutline[0] - *next, 0.0, kTouchWider);
  }
  for (int node = 0; node < columns_ * rows_; ++node) {
    double outline = 0.0, touch = 0.0, share = 0.0;
    if (const double strong = strongNear_[node];
        strong > 0.0 && magnitude_[node] > kOutline[0] * strong && shapeSurety_[node] > kSureNode[0]) {
      double sure = 0.0;
      nearest(node, [&](int other) { sure = std::max(sure, shapeSurety_[other]); });
      share = magnitude_[node] / strong;
      outline = ramp(share, kOutline) * ramp(strong / strongest, kNoSideLobe) * ramp(sure, kSure) *
                ramp(shapeSurety_[node], kSureNode);
    }
    if (outlined_ < 1.0 && touchShare_[node] > 0.0) {
      touch = ramp(touchShare_[node] + wider, kTouchOutline) *
              ramp(touchSurety_[node] / surestTouch, kNoTouchSideLobe) * ramp(touchSurety_[node], kSure);
    }
    weight_[node] = outlined_ * outline + (1.0 - outlined_) * touch;
    faintness_[node] = outlined_ * outline * (1.0 - share);
  }
}

void ContactStep::assemble(const double* displacement, std::span<const int> missing) {
  unknowns_.clear();
  scale_.clear();
  for (const int node : nodes_) {
    for (int axis = 0; axis < 3; ++axis) {
      unknowns_.push_back(3 * node + axis);
      scale_.push_back(weight_[node]);
    }
  }
  const int forces = static_cast<int>(unknowns_.size()), size = forces + kMotions;
  const int gone = static_cast<int>(missing.size());
  scale_.resize(static_cast<std::size_t>(size), 1.0);

  multiplyRows(inverse_.influence, unknowns_, displacement, right_.data());
  const int stride = inverse_.influence.stride();
  for (int k = 0; k < kMotions; ++k) {
    right_[forces + k] =
        dotProduct(motionModes_.data() + static_cast<std::ptrdiff_t>(k) * stride, displacement, stride);
  }
  for (int i = 0; i < size && gone > 0; ++i) {
    double* const row = missingRows_.data() + static_cast<std::ptrdiff_t>(i) * gone;
    if (i < forces) {
      const float* const influence = inverse_.influence.row(unknowns_[i]);
      for (int k = 0; k < gone; ++k) row[k] = influence[missing[k]];
    } else {
      const double* const motion = motionModes_.data() + static_cast<std::ptrdiff_t>(i - forces) * stride;
      for (int k = 0; k < gone; ++k) row[k] = motion[missing[k]];
    }
  }

  const auto element = [&](int i, int j) {
    if (i < forces) {
      const auto row = static_cast<std::size_t>(unknowns_[i]);
      return inverse_.gram[row * (row + 1) / 2 + static_cast<std::size_t>(unknowns_[j])];
    }
    if (j < forces) return motionCoupling_[static_cast<std::size_t>(unknowns_[j] * kMotions + i - forces)];
    return motionGram_[static_cast<std::size_t>((i - forces) * kMotions + j - forces)];
  };
  double* entry = matrix_.data();
  for (int i = 0; i < size; ++i) {
    const double* const row = missingRows_.data() + static_cast<std::ptrdiff_t>(i) * gone;
    for (int j = 0; j <= i; ++j, ++entry) {
      *entry = element(i, j);
      if (gone > 0) *entry -= dotProduct(row, missingRows_.data() + static_cast<std::ptrdiff_t>(j) * gone, gone);
      *entry *= scale_[i] * scale_[j];
    }
    right_[i] *= scale_[i];
    if (i < forces) {
      entry[-1] += square(lambda_);
    } else if (const double variance = inverse_.motionVariance[i - forces]; variance > 0.0) {
      entry[-1] += square(noise_px_) / variance;
    } else {  // that motion does not happen
      std::fill(entry - i - 1, entry - 1, 0.0);
      entry[-1] = 1.0;
      right_[i] = 0.0;
    }
  }
}

bool ContactStep::solve(const double* displacement, std::span<const int> missing, double squares,
                        std::span<const double> expected, double stiffness) {
  assert(nodes_.size() <= kMostNodes);
  lambda_ = stiffness * noise_px_ / expected_N_;
  assemble(displacement, missing);
  const int size = static_cast<int>(scale_.size()), forces = size - kMotions;
  if (!factoriseLower(matrix_, size, scratch_.data())) return false;
  std::fill(prior_.begin(), prior_.end(), 0.0);
  for (std::size_t i = 0; i < expected.size(); ++i) prior_[i] = expected[i] / std::max(scale_[i], kLeastScale);
  for (int i = 0; i < size; ++i) solution_[i] = right_[i] + square(lambda_) * prior_[i];
  solveLower(matrix_, size, solution_.data());
  solveLowerTransposed(matrix_, size, solution_.data());

  // |d - B x|^2 = |d|^2 - x'r - x'P (x - p), where (B'B + P) x = r + P p, r = B'd.
  squaredResidual_ = squares - dotProduct(solution_.data(), right_.data(), size) -
                     square(lambda_) * (dotProduct(solution_.data(), solution_.data(), forces) -
                                        dotProduct(solution_.data(), prior_.data(), forces));
  for (int k = 0; k < kMotions; ++k) {
    motion_[k] = solution_[forces + k];
    if (inverse_.motionVariance[k] > 0.0) {
      squaredResidual_ -= square(noise_px_ * motion_[k]) / inverse_.motionVariance[k];
    }
  }
  for (int i = 0; i < forces; ++i) forces_[i] = scale_[i] * solution_[i];
  return std::isfinite(squaredResidual_);
}

void ContactStep::prepare(double* functional) const {
  const int size = static_cast<int>(scale_.size()), forces = size - kMotions;
  for (int i = 0; i < forces; ++i) functional[i] *= scale_[i];
  std::fill(functional + forces, functional + size, 0.0);
  solveLower(matrix_, size, functional);
}

double ContactStep::covariance(const double* a, const double* b) const {
  return square(noise_px_) * dotProduct(a, b, static_cast<int>(scale_.size()));
}

void ContactStep::covariances(double* functionals, std::array<double, kColumns * kColumns>& result) const {
  const int size = static_cast<int>(scale_.size()), forces = size - kMotions;
  for (int i = 0; i < forces; ++i) {
    for (int k = 0; k < kColumns; ++k) functionals[kColumns * i + k] *= scale_[i];
  }
  std::fill(functionals + kColumns * forces, functionals + kColumns * size, 0.0);
  solveLowerColumns(matrix_, size, functionals);
  multiplyColumns(functionals, functionals, size, result.data());
  for (double& covariance : result) covariance *= square(noise_px_);
}

void ContactStep::deviations(double* deviation) {
  const int forces = static_cast<int>(scale_.size()) - kMotions;
  inverseDiagonal(matrix_, static_cast<int>(scale_.size()), scratch_.data(), variances_.data());
  for (int i = 0; i < forces; ++i) deviation[i] = noise_px_ * scale_[i] * std::sqrt(variances_[i]);
}

}  // namespace tractiond::solve

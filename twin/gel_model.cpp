#include "twin/gel_model.h"

#include "sensor/elastic/half_space.h"
#include "sensor/elastic/matrix_cache.h"
#include "sensor/elastic/quadrature.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace twin {

namespace {

using sensor::elastic::PatchQuadrature;

constexpr double kCacheVersion = 1.0;  // version of the cached correction
constexpr double kNodeSpacing = 5e-3;  // [m] adds one interpolation node
constexpr int kFewestNodes = 5;
// Step of the four-point Lagrange interpolation. The field varies over the depth of the markers, some millimetres, so
// the error is (step / depth)^4 / 40.
constexpr double kTableStep = 0.4e-3;  // [m]

/// Returns Chebyshev points of the interval.
Eigen::VectorXd interpolationNodes(double from, double to) {
  const int count = kFewestNodes + static_cast<int>((to - from) / kNodeSpacing);
  Eigen::VectorXd nodes(count);
  for (int i = 0; i < count; ++i) {
    nodes[i] = 0.5 * (from + to) - 0.5 * (to - from) * std::cos(std::numbers::pi * (i + 0.5) / count);
  }
  return nodes;
}

bool visitSamePlaces(const Contact& a, const Contact& b) {
  return std::ranges::equal(a.states, b.states, {}, &ContactState::position, &ContactState::position);
}

/// Returns the largest radius of the contacts that visit the same places as `contact` [m].
double largestRadius(const std::vector<Contact>& contacts, const Contact& contact) {
  double radius = contact.radius;
  for (const Contact& other : contacts) {
    if (visitSamePlaces(other, contact)) radius = std::max(radius, other.radius);
  }
  return radius;
}

/// Returns the range of the points of a patch of `radius` along one axis, over all times [m].
std::pair<double, double> visited(const Contact& contact, double radius, int axis) {
  double from = contact.states.front().position[axis], to = from;
  for (const ContactState& state : contact.states) {
    from = std::min(from, state.position[axis]);
    to = std::max(to, state.position[axis]);
  }
  return {from - radius, to + radius};
}

void append(std::vector<double>& key, const Eigen::Ref<const Eigen::MatrixXd>& numbers) {
  for (const double number : numbers.reshaped()) key.push_back(number);
}

Eigen::MatrixXd blockCorrection(const sensor::Gel& gel, const sensor::Points& markers, const sensor::Points& sources,
                                const std::filesystem::path& cache) {
  const sensor::elastic::BlockOptions options{.clearance = sensor::elastic::clearanceOf(gel, sources)};
  std::vector<double> key = {kCacheVersion, gel.youngsModulus, gel.poissonRatio, double(options.degree),
                             options.clearance};
  append(key, gel.size);
  append(key, markers);
  append(key, sources);
  if (!cache.empty()) {
    if (auto known = sensor::elastic::loadMatrix(cache, key)) return *std::move(known);
  }
  const Eigen::MatrixXd correction = sensor::elastic::BlockCorrection(gel, markers, options).matrix(sources);
  if (!cache.empty()) sensor::elastic::saveMatrix(cache, key, correction);
  return correction;
}

UnitResponse sum(const sensor::Gel& gel, const PatchQuadrature& pressed, const PatchQuadrature& turned,
                 const Eigen::Vector3d& point) {
  UnitResponse response = UnitResponse::Zero();
  for (Eigen::Index i = 0; i < pressed.points.cols(); ++i) {
    const Eigen::Matrix3d field =
        sensor::elastic::halfSpaceDisplacement(point - pressed.points.col(i), gel.youngsModulus, gel.poissonRatio);
    response.leftCols<3>() += pressed.forces(2, i) * field;
  }
  for (Eigen::Index i = 0; i < turned.points.cols(); ++i) {
    response.col(3) +=
        sensor::elastic::halfSpaceDisplacement(point - turned.points.col(i), gel.youngsModulus, gel.poissonRatio) *
        turned.forces.col(i);
  }
  return response;
}

}  // namespace

PatchField::PatchField(const sensor::Gel& gel, const PatchQuadrature& pressed, const PatchQuadrature& turned,
                       const std::vector<double>& depths, double farthest) {
  const int last = static_cast<int>(std::ceil(farthest / kTableStep)) + 2;
  for (const double depth : depths) {
    std::vector<UnitResponse>& table = tables_.emplace_back();
    // Starts one step on the other side, so that the first interval has a neighbour on both sides.
    for (int i = -1; i <= last; ++i) table.push_back(sum(gel, pressed, turned, {i * kTableStep, 0.0, depth}));
  }
}

UnitResponse PatchField::at(std::size_t depth, const Eigen::Vector2d& offset) const {
  const std::vector<UnitResponse>& table = tables_[depth];
  const double distance = offset.norm();
  const double place = distance / kTableStep;
  const auto index = std::min(static_cast<std::size_t>(place), table.size() - 4);
  const double t = place - static_cast<double>(index);  // 0 at table[index + 1]
  const UnitResponse onAxis =
      (-t * (t - 1) * (t - 2) / 6) * table[index] + ((t + 1) * (t - 1) * (t - 2) / 2) * table[index + 1] +
      (-(t + 1) * t * (t - 2) / 2) * table[index + 2] + ((t + 1) * t * (t - 1) / 6) * table[index + 3];
  const Eigen::Vector2d direction = distance > 0.0 ? Eigen::Vector2d(offset / distance) : Eigen::Vector2d(1.0, 0.0);
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn.topLeftCorner<2, 2>() << direction.x(), -direction.y(), direction.y(), direction.x();
  UnitResponse response;
  response.leftCols<3>() = turn * onAxis.leftCols<3>() * turn.transpose();
  response.col(3) = turn * onAxis.col(3);
  return response;
}

GelModel::GelModel(const sensor::Sensor& sensor, const std::vector<Contact>& contacts,
                   const std::filesystem::path& cache)
    : markers_(sensor::markerPositions(sensor.layers))
    , displacement_(sensor::Points::Zero(3, markers_.cols())) {
  std::vector<double> depths;
  for (const sensor::MarkerLayer& layer : sensor.layers) {
    depthIndex_.insert(depthIndex_.end(), static_cast<std::size_t>(layer.count()), depths.size());
    depths.push_back(layer.depth);
  }
  std::vector<Eigen::Vector3d> sources;
  for (const Contact& contact : contacts) {
    const auto spread = contact.shape == Contact::Shape::kHertz ? sensor::elastic::hertz : sensor::elastic::disc;
    const auto pressed = spread(Eigen::Vector2d::Zero(), contact.radius, Eigen::Vector3d::UnitZ(), 0);
    const auto turned = sensor::elastic::twist(Eigen::Vector2d::Zero(), contact.radius, 1.0);
    const double farthest = sensor.gel.size.head<2>().norm();
    const double radius = largestRadius(contacts, contact);
    const auto [left, right] = visited(contact, radius, 0);
    const auto [low, high] = visited(contact, radius, 1);
    const auto same = std::ranges::find_if(contacts, [&](const Contact& c) { return visitSamePlaces(c, contact); });
    const auto before = static_cast<std::size_t>(same - contacts.begin());
    const bool isNew = before == patches_.size();
    Eigen::Matrix2Xd points(2, pressed.points.cols() + turned.points.cols());
    points << pressed.points.topRows<2>(), turned.points.topRows<2>();
    Eigen::VectorXd share = Eigen::VectorXd::Zero(points.cols());
    share.head(pressed.points.cols()) = pressed.forces.row(2);
    Eigen::Matrix2Xd turning = Eigen::Matrix2Xd::Zero(2, points.cols());
    turning.rightCols(turned.points.cols()) = turned.forces.topRows<2>();
    patches_.push_back({PatchField(sensor.gel, pressed, turned, depths, farthest), points, share, turning,
                        interpolationNodes(left, right), interpolationNodes(low, high),
                        isNew ? 3 * static_cast<Eigen::Index>(sources.size()) : patches_[before].firstColumn});
    if (!isNew) continue;
    for (const double y : patches_.back().nodesY) {
      for (const double x : patches_.back().nodesX) sources.emplace_back(x, y, 0.0);
    }
  }
  if (sources.empty()) return;
  const sensor::Points nodes = Eigen::Map<const sensor::Points>(sources.front().data(), 3, sources.size());
  correction_ = blockCorrection(sensor.gel, markers_, nodes, cache);
  loads_.resize(correction_.cols());
}

const sensor::Points& GelModel::displacement(std::span<const ContactState> states) {
  if (std::equal(states.begin(), states.end(), states_.begin(), states_.end())) return displacement_;
  states_.assign(states.begin(), states.end());
  displacement_.setZero();
  loads_.setZero();
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    if (states[i].isLoaded()) add(patches_[i], states[i]);
  }
  if (!loads_.isZero(0.0)) displacement_.reshaped() += correction_ * loads_;
  return displacement_;
}

void GelModel::add(const Patch& patch, const ContactState& state) {
  Eigen::Vector4d load;
  load << state.force, state.torque;
  for (Eigen::Index i = 0; i < markers_.cols(); ++i) {
    displacement_.col(i) += patch.field.at(depthIndex_[i], markers_.col(i).head<2>() - state.position) * load;
  }
  const Eigen::MatrixXd onX =
      sensor::elastic::lagrange(patch.nodesX, (patch.points.row(0).array() + state.position.x()).matrix().transpose());
  const Eigen::MatrixXd onY =
      sensor::elastic::lagrange(patch.nodesY, (patch.points.row(1).array() + state.position.y()).matrix().transpose());
  Eigen::Index column = patch.firstColumn;
  for (Eigen::Index y = 0; y < patch.nodesY.size(); ++y) {
    for (Eigen::Index x = 0; x < patch.nodesX.size(); ++x, column += 3) {
      const Eigen::VectorXd weight = onX.col(x).cwiseProduct(onY.col(y));
      loads_.segment<3>(column) += state.force * weight.dot(patch.pressed);
      loads_.segment<2>(column) += state.torque * (patch.turning * weight);
    }
  }
}

}  // namespace twin

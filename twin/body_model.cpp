#include "twin/body_model.h"

#include "sensor/elastic/influence.h"
#include "sensor/elastic/loads.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace twin {

namespace {

constexpr double kNarrowest = 0.05;  // radius of the smallest patch, of the nodes' distance
constexpr int kRings = 6;            // of points of a patch: closer than the nodes, so that it moves smoothly over them
constexpr int kMostSteps = 20;       // of Newton's method; 3 or 4 on a ball
constexpr double kClose = 1e-9;      // [m]

/// Returns weights (first column) of the four values at -1, 0, 1, 2 and their derivatives, at t between 0 and 1.
Eigen::Matrix<double, 4, 2> cubic(double t) {
  Eigen::Matrix<double, 4, 2> weights;
  weights << ((2 - t) * t - 1) * t / 2, ((4 - 3 * t) * t - 1) / 2,  //
      ((3 * t - 5) * t * t + 2) / 2, (9 * t - 10) * t / 2,          //
      ((4 - 3 * t) * t + 1) * t / 2, ((8 - 9 * t) * t + 1) / 2,     //
      (t - 1) * t * t / 2, (3 * t - 2) * t / 2;
  return weights;
}

/// Returns the radius of a patch of the same shape that has, when each of its points is spread over a square of this
/// area, the spread of the contact: its mean squared distance from a line through the centre is the squared radius over
/// 5 (Hertz) or 4 (a disc), that of a square a twelfth of the area.
double narrowed(const Contact& contact, double area) {
  const double perSpread = contact.shape == Contact::Shape::kHertz ? 5.0 : 4.0;
  return std::sqrt(std::max(contact.radius * contact.radius - perSpread / 12.0 * area, kNarrowest * kNarrowest * area));
}

}  // namespace

/// A place on the surface.
struct BodyModel::Spot {
  Eigen::Vector2d grid;  ///< column and row
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 3, 2> slope = Eigen::Matrix<double, 3, 2>::Zero();  ///< of the place by column and row
  std::array<Eigen::Index, 16> nodes{};
  std::array<double, 16> shares{};
  double off = 0.0;  ///< distance from what was looked for [m]
};

BodyModel::BodyModel(const sensor::Sensor& sensor)
    : columns_(sensor.nodes.columns)
    , rows_(sensor.nodes.rows)
    , nodes_(sensor::nodePositions(sensor))
    , normals_(sensor::nodeNormals(sensor))
    , areas_(sensor::nodeAreas(sensor))
    , influence_(sensor::elastic::displacementMatrix(sensor, sensor::elastic::Model::kBlock)) {
  assert(sensor.body && columns_ >= 4 && rows_ >= 4);
}

BodyModel::Spot BodyModel::at(const Eigen::Vector2d& grid) const {
  Spot spot{.grid = grid};
  const int column = std::min(static_cast<int>(grid.x()), columns_ - 3);
  const int row = std::min(static_cast<int>(grid.y()), rows_ - 3);
  const auto across = cubic(grid.x() - column), up = cubic(grid.y() - row);
  for (std::size_t i = 0; i < spot.nodes.size(); ++i) {
    const auto x = static_cast<Eigen::Index>(i % 4), y = static_cast<Eigen::Index>(i / 4);
    spot.nodes[i] = (row - 1 + y) * columns_ + column - 1 + x;
    spot.shares[i] = across(x, 0) * up(y, 0);
    spot.place += spot.shares[i] * nodes_.col(spot.nodes[i]);
    spot.slope.col(0) += across(x, 1) * up(y, 0) * nodes_.col(spot.nodes[i]);
    spot.slope.col(1) += across(x, 0) * up(y, 1) * nodes_.col(spot.nodes[i]);
  }
  return spot;
}

BodyModel::Spot BodyModel::find(const Eigen::Matrix<double, 2, 3>& along, const Eigen::Vector2d& target,
                                Eigen::Vector2d grid) const {
  const Eigen::Vector2d first(1.0, 1.0), last(columns_ - 2, rows_ - 2);
  for (int step = 0;; ++step) {
    Spot spot = at(grid.cwiseMax(first).cwiseMin(last));
    const Eigen::Vector2d off = target - along * spot.place;
    spot.off = off.norm();
    const Eigen::Matrix2d slope = along * spot.slope;
    if (spot.off < kClose || step == kMostSteps || slope.determinant() == 0.0) return spot;
    grid = spot.grid + slope.inverse() * off;
  }
}

BodyLoad BodyModel::load(const Contact& contact, const ContactState& state) const {
  BodyLoad load;
  load.nodeForces = sensor::Points::Zero(3, nodes_.cols());
  Eigen::Index nearest = 0;
  (nodes_.topRows<2>().colwise() - state.position).colwise().squaredNorm().minCoeff(&nearest);
  const Spot centre = find(Eigen::Matrix<double, 2, 3>::Identity(), state.position,
                           Eigen::Vector2d(nearest % columns_, nearest / columns_));
  double area = 0.0;
  for (std::size_t i = 0; i < centre.nodes.size(); ++i) {
    load.normal += centre.shares[i] * normals_.col(centre.nodes[i]);
    area += centre.shares[i] * areas_[centre.nodes[i]];
  }
  load.normal.normalize();
  const Eigen::Matrix3d turn =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), load.normal).toRotationMatrix();
  load.place = centre.place;
  load.force = turn * state.force;
  load.isWithin = centre.off < kClose;
  const Eigen::Matrix<double, 2, 3> tangents = turn.leftCols<2>().transpose();
  const double radius = narrowed(contact, area);
  const auto spread = contact.shape == Contact::Shape::kHertz ? sensor::elastic::hertz : sensor::elastic::disc;
  for (const sensor::elastic::PatchQuadrature& patch :
       {spread(Eigen::Vector2d::Zero(), radius, state.force, kRings),
        sensor::elastic::twist(Eigen::Vector2d::Zero(), radius, state.torque, kRings)}) {
    for (Eigen::Index point = 0; point < patch.points.cols(); ++point) {
      const Spot spot = find(tangents, tangents * load.place + patch.points.col(point).head<2>(), centre.grid);
      load.isWithin = load.isWithin && spot.off < kClose;
      const Eigen::Vector3d force = turn * patch.forces.col(point);
      for (std::size_t i = 0; i < spot.nodes.size(); ++i) load.nodeForces.col(spot.nodes[i]) += spot.shares[i] * force;
    }
  }
  return load;
}

sensor::Points BodyModel::displacement(const sensor::Points& nodeForces) const {
  return (influence_ * nodeForces.reshaped()).reshaped(3, influence_.rows() / 3);
}

Eigen::Vector3d BodyModel::moment(const sensor::Points& nodeForces) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (Eigen::Index n = 0; n < nodes_.cols(); ++n) {
    sum += Eigen::Vector3d(nodes_.col(n)).cross(Eigen::Vector3d(nodeForces.col(n)));
  }
  return sum;
}

}  // namespace twin

#include "twin/patch_field.h"

#include "sensor/elastic/half_space.h"
#include "sensor/elastic/loads.h"

#include <algorithm>
#include <cmath>

namespace twin {

namespace {

using sensor::elastic::PatchQuadrature;

// Step of the four-point Lagrange interpolation. The field varies over the depth of the markers, some millimetres, so
// the error is (step / depth)^4 / 40.
constexpr double kStep = 0.4e-3;  // [m]

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

PatchField::PatchField(const sensor::Gel& gel, Contact::Shape shape, double radius, const std::vector<double>& depths,
                       double farthest) {
  const auto spread = shape == Contact::Shape::kHertz ? sensor::elastic::hertz : sensor::elastic::disc;
  const PatchQuadrature pressed = spread(Eigen::Vector2d::Zero(), radius, Eigen::Vector3d::UnitZ(), 0);
  const PatchQuadrature turned = sensor::elastic::twist(Eigen::Vector2d::Zero(), radius, 1.0);
  const int last = static_cast<int>(std::ceil(farthest / kStep)) + 2;
  for (const double depth : depths) {
    std::vector<UnitResponse>& table = tables_.emplace_back();
    // Starts one step on the other side, so that the first interval has a neighbour on both sides.
    for (int i = -1; i <= last; ++i) table.push_back(sum(gel, pressed, turned, {i * kStep, 0.0, depth}));
  }
}

UnitResponse PatchField::at(std::size_t depth, const Eigen::Vector2d& offset) const {
  const std::vector<UnitResponse>& table = tables_[depth];
  const double distance = offset.norm();
  const double place = distance / kStep;
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

}  // namespace twin

#include "daemon/solve/systematic.h"

#include "sensor/elastic/influence.h"

#include <Eigen/Dense>

#include <cmath>

namespace tractiond::solve {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

/// The camera a deviation elsewhere; nothing where that deviation is 0.
sensor::Camera strayed(const sensor::Sensor& sensor, int number) {
  sensor::Camera camera = sensor.camera;
  const sensor::Uncertainty& by = sensor.uncertainty;
  if (number < 3)
    camera.position[number] += by.position[number];
  else if (number < 6)
    camera.rotation[number - 3] += by.rotation[number - 3];
  else
    camera.focal_px *= 1.0 + by.focal * std::sqrt(1.0 - by.focalDistance * by.focalDistance);
  if (number == 2) camera.focal_px *= 1.0 + by.focal * by.focalDistance;  // what strays with the distance
  return camera;
}
constexpr int kPoseNumbers = kPoseErrors / 36;

/// 6 x 3: the wrench of unit forces at a point.
Eigen::Matrix<double, 6, 3> unitWrenches(const Eigen::Vector3d& at) {
  Eigen::Matrix<double, 6, 3> wrenches;
  wrenches << Eigen::Matrix3d::Identity(), 0.0, -at.z(), at.y(), at.z(), 0.0, -at.x(), -at.y(), at.x(), 0.0;
  return wrenches;
}

}  // namespace

std::vector<double> poseErrors(const sensor::Sensor& sensor, const Eigen::MatrixXd& displacement,
                               const Inverse& inverse) {
  const sensor::NodeGrid& grid = sensor.nodes;
  const sensor::Points nodes = sensor::nodePositions(sensor);
  std::vector<Eigen::Index> columns;
  Eigen::MatrixXd wrenches(6, 27);
  for (const int row : {grid.rows / 4, grid.rows / 2, grid.rows * 3 / 4}) {
    for (const int column : {grid.columns / 4, grid.columns / 2, grid.columns * 3 / 4}) {
      const int node = row * grid.columns + column;
      wrenches.middleCols<3>(static_cast<Eigen::Index>(columns.size())) = unitWrenches(nodes.col(node));
      for (int axis = 0; axis < 3; ++axis) columns.push_back(3 * node + axis);
    }
  }
  const Eigen::MatrixXd unit = displacement(Eigen::all, columns);
  const Eigen::MatrixXd seen = sensor::elastic::toImage(sensor, unit);
  const Eigen::MatrixXd right = wrenches.transpose() * (wrenches * wrenches.transpose()).inverse();

  // 6 x 2M: from displacements to the wrench.
  Eigen::MatrixXd modes = Eigen::MatrixXd::Zero(inverse.rank(), 6);
  for (int k = 0; k < inverse.rank(); ++k) {
    const float* const v = inverse.right.row(k);
    for (Eigen::Index node = 0; node < nodes.cols(); ++node)
      modes.row(k) += (unitWrenches(nodes.col(node)) * Eigen::Vector3f::Map(v + 3 * node).cast<double>()).transpose();
    const double s = inverse.singularValues[k];
    modes.row(k) *= s / (s * s + inverse.lambda * inverse.lambda);
  }
  Eigen::MatrixXd solve(6, inverse.coordinateCount());
  for (int i = 0; i < inverse.coordinateCount(); ++i)
    solve.col(i) = modes.transpose() * Eigen::VectorXf::Map(inverse.left.row(i), inverse.rank()).cast<double>();

  std::vector<double> errors;
  for (int number = 0; number < kPoseNumbers; ++number) {
    sensor::Sensor elsewhere = sensor;
    elsewhere.camera = strayed(sensor, number);
    const Matrix6 error = solve * (sensor::elastic::toImage(elsewhere, unit) - seen) * right;
    errors.insert(errors.end(), error.data(), error.data() + error.size());
  }
  return errors;
}

WrenchCovariance systematicCovariance(const std::array<double, 6>& wrench, const sensor::Uncertainty& uncertainty,
                                      double pitch_m, const std::vector<double>& poseErrors) {
  const Vector6 w = Vector6::Map(wrench.data());
  const double force = w.head<3>().squaredNorm(), moment = w.tail<3>().squaredNorm();
  Matrix6 covariance = (uncertainty.youngsModulus * uncertainty.youngsModulus) * w * w.transpose();
  // The mechanics err in any direction, and misplace the force by a like share of a node's pitch.
  const double model = uncertainty.model * uncertainty.model;
  covariance.diagonal().head<3>().array() += model * force;
  covariance.diagonal().tail<3>().array() += model * (moment + pitch_m * pitch_m * force);
  for (std::size_t k = 0; k < poseErrors.size(); k += 36) {
    const Vector6 error = Eigen::Map<const Matrix6>(poseErrors.data() + k) * w;
    covariance += error * error.transpose();
  }
  WrenchCovariance result;
  Eigen::Map<Matrix6>(result.data()) = covariance;
  return result;
}

}  // namespace tractiond::solve

#include "tests/simulation/gel.h"

#include "daemon/solve/wrench.h"
#include "sensor/elastic/influence.h"
#include "tests/simulation/disk.h"

#include <Eigen/Cholesky>

#include <cmath>
#include <utility>

namespace tractiond::simulation {

Gel::Gel() {
  for (sensor::MarkerLayer& layer : sensor.layers) {
    layer.columns = 8;
    layer.rows = 6;
  }
  sensor.nodes.columns = 7;
  sensor.nodes.rows = 6;
  options.model = sensor::elastic::Model::kHalfSpace;
  places = track::nominalPlaces(sensor);
  const Eigen::MatrixXd exact =
      sensor::elastic::toImage(sensor, sensor::elastic::displacementMatrix(sensor, options.model));
  invert(exact);
  Eigen::VectorXd force = Eigen::VectorXd::Zero(exact.cols());
  for (const int node : {16, 17, 23, 24}) force[3 * node + 2] = 0.25;
  press = exact * force;
  Chance chance(1);
  const auto uniform = [&chance] { return (static_cast<double>(chance.next() >> 11) + 0.5) * 0x1p-53; };
  constexpr std::size_t kNoises = 128;
  for (std::size_t k = 0; k < kNoises; ++k) {
    std::vector<float> noise(2 * places.size());
    for (float& value : noise)
      value = static_cast<float>(kNoise_px * std::sqrt(-2.0 * std::log(uniform())) * std::cos(2.0 * M_PI * uniform()));
    noises.push_back(std::move(noise));
  }
}

/// Expects forces of 0.1 N of the nodes.
void Gel::invert(const Eigen::MatrixXd& exact) {
  constexpr double kExpected_N = 0.1;
  Eigen::MatrixXd normal = exact.transpose() * exact;
  normal.diagonal().array() += (kNoise_px / kExpected_N) * (kNoise_px / kExpected_N);
  const Eigen::MatrixXd toForces = normal.llt().solve(exact.transpose());
  const sensor::Points nodes = sensor::nodePositions(sensor);
  Eigen::MatrixXd wrenches(6, exact.cols());
  for (Eigen::Index n = 0; n < nodes.cols(); ++n) wrenches.middleCols<3>(3 * n) = solve::unitWrenches(nodes.col(n));
  const Eigen::MatrixXd toWrench = wrenches * toForces;
  influence = exact.cast<float>();
  inverse = toForces.cast<float>();
  deviation = toForces.rowwise().norm().cast<float>();
  covariance = toWrench * toWrench.transpose();
}

}  // namespace tractiond::simulation

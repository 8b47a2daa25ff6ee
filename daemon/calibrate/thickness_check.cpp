#include "daemon/calibrate/thickness_check.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

namespace tractiond::calibrate {

namespace {

constexpr double kThinner =
    0.85;  // of the thickness: a secant is used, as the effect grows when the block becomes thinner
constexpr double kStep_m = 1e-5;  // step of place, radius and depth for finite differences
constexpr double kLeastInformation = 1e-12;

sensor::Sensor withThickness(sensor::Sensor sensor, double share) {
  sensor.gel.size.z() *= share;
  return sensor;
}

sensor::Sensor withPoisson(sensor::Sensor sensor) {
  sensor.gel.poissonRatio -= sensor.uncertainty.poissonRatio;
  return sensor;
}

}  // namespace

ThicknessCheck::ThicknessCheck(const sensor::Sensor& sensor, const ContactFit& fit,
                               const sensor::elastic::Progress& progress)
    : sensor_(sensor)
    , fit_(fit)
    , thinner_(withThickness(sensor, kThinner), progress)
    , softer_(withPoisson(sensor), progress) {}

std::optional<ThicknessReading> ThicknessCheck::operator()(const sensor::Camera& camera,
                                                           const sensor::PictureMotion& motion,
                                                           const Displacements& displacements,
                                                           std::span<const float> variance_px2,
                                                           const ContactReading& reading) const {
  const sensor::Uncertainty& known = sensor_.uncertainty;
  const double thickness = sensor_.gel.size.z();
  const Eigen::Vector3d shape(reading.place.x(), reading.place.y(), reading.radius);
  const Eigen::Vector3d& force = reading.force;
  const auto layers = static_cast<Eigen::Index>(sensor_.layers.size());
  const Eigen::Index markers = static_cast<Eigen::Index>(displacements.valid.size()), rows = 2 * markers;

  // Columns: force, shape, motion, Poisson's ratio, depths, thickness. The last is in metres, the two before in
  // deviations.
  const Eigen::Index kForce = 0, kShape = 3, kMotion = 6, kPoisson = 10, kDepth = 11, kThickness = kDepth + layers;
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(rows, kThickness + 1);
  columns.middleCols<3>(kForce) = fit_.fields(camera, shape);
  const Eigen::VectorXd expected = columns.middleCols<3>(kForce) * force;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d step = kStep_m * Eigen::Vector3d::Unit(k);
    columns.col(kShape + k) =
        (fit_.fields(camera, shape + step) - fit_.fields(camera, shape - step)) * force / (2.0 * kStep_m);
  }
  sensor::Sensor seen = sensor_;
  seen.camera = camera;
  const PictureMotionFit motionFit(seen);
  for (Eigen::Index m = 0; m < markers; ++m) {
    for (int k = 0; k < 4; ++k) {
      columns.col(kMotion + k).segment<2>(2 * m) = motionFit.at(static_cast<int>(m), Eigen::Vector4d::Unit(k));
    }
  }
  columns.col(kPoisson) = softer_.fields(camera, shape) * force - expected;
  // The correction for the block's sides and base is smooth: an error of a layer's depth does not change it.
  const Eigen::VectorXd deeper =
      (fit_.fields(camera, shape, kStep_m) * force - expected) * (known.layerDepth / kStep_m);
  Eigen::Index first = 0;
  for (Eigen::Index layer = 0; layer < layers; ++layer) {
    const Eigen::Index count = 2 * sensor_.layers[static_cast<std::size_t>(layer)].count();
    columns.col(kDepth + layer).segment(first, count) = deeper.segment(first, count);
    first += count;
  }
  columns.col(kThickness) = (thinner_.fields(camera, shape) * force - expected) / ((kThinner - 1.0) * thickness);

  Eigen::VectorXd residual(rows), weight(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const auto m = static_cast<std::size_t>(i / 2);
    const bool valid = displacements.valid[m] != 0 && variance_px2[m] > 0.0F;
    residual[i] = valid ? static_cast<double>(displacements.value_px[static_cast<std::size_t>(i)]) - expected[i] : 0.0;
    weight[i] = valid ? 1.0 / static_cast<double>(variance_px2[m]) : 0.0;
  }
  Eigen::VectorXd prior = Eigen::VectorXd::Zero(columns.cols());
  prior.segment<4>(kMotion) << motion.shift_px, motion.shift_px, motion.scale, motion.roll;
  prior.segment<4>(kMotion) = prior.segment<4>(kMotion).cwiseAbs2().cwiseInverse().eval();
  prior.segment(kPoisson, 1 + layers).setOnes();
  const Eigen::MatrixXd weighted = weight.asDiagonal() * columns;
  Eigen::MatrixXd normal = columns.transpose() * weighted;
  normal.diagonal() += prior;
  const Eigen::VectorXd right = weighted.transpose() * residual;
  const Eigen::VectorXd scale = normal.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::LDLT<Eigen::MatrixXd> factor(scale.asDiagonal() * normal * scale.asDiagonal());
  const Eigen::VectorXd found = scale.cwiseProduct(factor.solve(scale.cwiseProduct(right)));
  const Eigen::VectorXd unit = Eigen::VectorXd::Unit(columns.cols(), kThickness);
  const double variance = scale[kThickness] * scale[kThickness] * factor.solve(unit)[kThickness];
  if (!found.allFinite() || !(variance > 0.0) || variance > 1.0 / kLeastInformation) return std::nullopt;

  // A residual beyond the noise has a cause that is none of the unknowns, and may also have changed this one.
  const Eigen::VectorXd left = residual - columns * found;
  const double coordinates = static_cast<double>((weight.array() > 0.0).count());
  const double excess = left.cwiseAbs2().dot(weight) / std::max(coordinates - static_cast<double>(columns.cols()), 1.0);
  ThicknessReading result;
  result.thickness = thickness + found[kThickness];
  result.deviation = std::sqrt(variance * std::max(excess, 1.0) + known.thickness * known.thickness);
  return result;
}

}  // namespace tractiond::calibrate

#include "daemon/calibrate/thickness_check.h"

#include "daemon/calibrate/scaled_equations.h"

#include <algorithm>
#include <cmath>

namespace tractiond::calibrate {

namespace {

constexpr double kThinner =
    0.85;  // of the thickness: a secant is used, as the effect grows when the block becomes thinner
constexpr double kStep_m = 1e-5;  // step of place, radius and depth for finite differences
constexpr double kLeastInformation = 1e-12;

}  // namespace

ThicknessCheck::ThicknessCheck(const sensor::Sensor& sensor, const ContactFit& fit)
    : sensor_(sensor)
    , fit_(fit) {
  if (sensor.body) return;
  sensor::Sensor thinner = sensor, softer = sensor;
  thinner.gel.size.z() *= kThinner;
  softer.gel.poissonRatio -= sensor.uncertainty.poissonRatio;
  thinner_.emplace(thinner);
  softer_.emplace(softer);
}

ThicknessCheck::Load ThicknessCheck::loadOf(const sensor::Sensor& seen, const Displacements& displacements,
                                            std::span<const float> variance_px2, const ContactReading& reading) const {
  Load load;
  load.shape = reading.shape;
  load.force = reading.force;
  const Eigen::Index rows = 2 * static_cast<Eigen::Index>(displacements.valid.size());
  load.columns.resize(rows, kOfLoad);
  load.columns.leftCols<3>() = fit_.fields(seen.camera, load.shape);
  load.expected = load.columns.leftCols<3>() * load.force;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d step = kStep_m * Eigen::Vector3d::Unit(k);
    load.columns.col(3 + k) =
        (fit_.fields(seen.camera, load.shape + step) - fit_.fields(seen.camera, load.shape - step)) * load.force /
        (2.0 * kStep_m);
  }
  const Observed observed = observe(seen, displacements, variance_px2);
  load.columns.rightCols<4>() = observed.byMotion;
  load.weight = observed.weight;
  load.residual = (load.weight.array() > 0.0).select(observed.value_px - load.expected, 0.0);
  load.prior.setZero(kOfLoad);
  load.prior.tail<4>() = observed.motionWeight;
  return load;
}

Eigen::MatrixXd ThicknessCheck::byElasticity(const sensor::Camera& camera, const Load& load) const {
  if (sensor_.body) {
    const std::size_t errors = sensor_.body->errors.size();
    Eigen::MatrixXd columns(load.expected.size(), static_cast<Eigen::Index>(errors));
    for (std::size_t i = 0; i < errors; ++i) {
      columns.col(static_cast<Eigen::Index>(i)) = fit_.fieldErrors(camera, load.shape, i) * load.force;
    }
    return columns;
  }
  const auto layers = static_cast<Eigen::Index>(sensor_.layers.size());
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(load.expected.size(), 1 + layers);
  columns.col(0) = softer_->fields(camera, load.shape) * load.force - load.expected;
  // The correction for the block's sides and base is smooth: an error of a layer's depth does not change it.
  const Eigen::VectorXd deeper = (fit_.fields(camera, load.shape, kStep_m) * load.force - load.expected) *
                                 (sensor_.uncertainty.layerDepth / kStep_m);
  Eigen::Index first = 0;
  for (Eigen::Index layer = 0; layer < layers; ++layer) {
    const Eigen::Index count = 2 * sensor_.layers[static_cast<std::size_t>(layer)].count();
    columns.col(1 + layer).segment(first, count) = deeper.segment(first, count);
    first += count;
  }
  return columns;
}

/// Returns the change of the displacements per metre of the thickness.
Eigen::VectorXd ThicknessCheck::byThickness(const sensor::Camera& camera, const Load& load) const {
  return (thinner_->fields(camera, load.shape) * load.force - load.expected) /
         ((kThinner - 1.0) * sensor_.gel.size.z());
}

std::optional<ThicknessReading> ThicknessCheck::operator()(const sensor::Sensor& seen,
                                                           const Displacements& displacements,
                                                           std::span<const float> variance_px2,
                                                           const ContactReading& reading) const {
  if (sensor_.body) return std::nullopt;
  const Load load = loadOf(seen, displacements, variance_px2, reading);
  // Columns: of the load, Poisson's ratio, depths, thickness. The last is in metres, the two before in deviations.
  const Eigen::Index known = 1 + static_cast<Eigen::Index>(sensor_.layers.size()), kThickness = kOfLoad + known;
  Eigen::MatrixXd columns(load.expected.size(), kThickness + 1);
  columns << load.columns, byElasticity(seen.camera, load), byThickness(seen.camera, load);
  Eigen::VectorXd prior = Eigen::VectorXd::Zero(columns.cols());
  prior.head(kOfLoad) = load.prior;
  prior.segment(kOfLoad, known).setOnes();
  const Eigen::MatrixXd weighted = load.weight.asDiagonal() * columns;
  Eigen::MatrixXd normal = columns.transpose() * weighted;
  normal.diagonal() += prior;
  const ScaledEquations equations(normal);
  const Eigen::VectorXd found = equations.solve(weighted.transpose() * load.residual);
  const double variance = equations.variance(kThickness);
  if (!found.allFinite() || !(variance > 0.0) || variance > 1.0 / kLeastInformation) return std::nullopt;

  // A residual beyond the noise has a cause that is none of the unknowns, and may also have changed this one.
  const Eigen::VectorXd left = load.residual - columns * found;
  const double coordinates = static_cast<double>((load.weight.array() > 0.0).count());
  const double excess =
      left.cwiseAbs2().dot(load.weight) / std::max(coordinates - static_cast<double>(columns.cols()), 1.0);
  ThicknessReading result;
  result.thickness = sensor_.gel.size.z() + found[kThickness];
  const double ofFile = sensor_.uncertainty.thickness;
  result.deviation = std::sqrt(variance * std::max(excess, 1.0) + ofFile * ofFile);
  return result;
}

double ThicknessCheck::absorbed(const sensor::Sensor& seen, const Displacements& displacements,
                                std::span<const float> variance_px2, const ContactReading& reading) const {
  const sensor::Uncertainty& known = seen.uncertainty;
  const Load load = loadOf(seen, displacements, variance_px2, reading);
  const Eigen::MatrixXd weighted = load.weight.asDiagonal() * load.columns;
  Eigen::MatrixXd normal = load.columns.transpose() * weighted;
  normal.diagonal() += load.prior;
  const ScaledEquations equations(normal);
  // How much of the known force a fit takes for a change of the displacements, relative.
  const auto misread = [&](const Eigen::VectorXd& change) {
    const Eigen::VectorXd taken = equations.solve(weighted.transpose() * change);
    return taken.head<3>().dot(reading.along) / load.force.dot(reading.along);
  };
  const auto byCamera = [&](const auto& moveBy, double deviation, double step) {
    sensor::Camera moved = seen.camera;
    moveBy(moved, step);
    return misread((fit_.fields(moved, load.shape) * load.force - load.expected) * (deviation / step));
  };
  double sum = sensor_.body ? 0.0 : std::pow(misread(byThickness(seen.camera, load) * known.thickness), 2);
  const Eigen::MatrixXd changes = byElasticity(seen.camera, load);
  for (const auto& change : changes.colwise()) sum += std::pow(misread(change), 2);
  for (int axis = 0; axis < 3; ++axis) {
    const auto turn = [axis](sensor::Camera& moved, double by) { moved.rotation[axis] += by; };
    sum += std::pow(byCamera(turn, known.rotation[axis], 1e-4), 2);
  }
  for (int axis = 0; axis < 2; ++axis) {
    const auto shift = [axis](sensor::Camera& moved, double by) { moved.position[axis] += by; };
    sum += std::pow(byCamera(shift, known.position[axis], 1e-4), 2);
  }
  const auto away = [](sensor::Camera& moved, double by) { moved.position.z() += by; };
  const auto longer = [](sensor::Camera& moved, double by) { moved.focal_px *= 1.0 + by; };
  const double ofDistance = byCamera(away, known.position.z(), 1e-4), ofFocal = byCamera(longer, known.focal, 1e-4);
  sum += ofDistance * ofDistance + ofFocal * ofFocal + 2.0 * known.focalDistance * ofDistance * ofFocal;
  return std::sqrt(std::max(sum, 0.0) + known.model * known.model);
}

}  // namespace tractiond::calibrate

#include "sensor/sensor.h"

namespace sensor {

int Sensor::markerCount() const {
  int count = 0;
  for (const MarkerLayer& layer : layers) count += layer.count();
  return count;
}

Uncertainty deviationsOf(const Sensor& sensor) {
  Uncertainty all = sensor.uncertainty;
  if (sensor.markerCount() >= kVerifying) return all;
  constexpr double kUnverified = 2.0;
  for (double* each : {&all.focal, &all.layerDepth, &all.markerDepth}) *each *= kUnverified;
  all.position *= kUnverified;
  all.rotation *= kUnverified;
  return all;
}

Points markerPositions(const Sensor& sensor) {
  if (sensor.body) return sensor.body->markers;
  Points markers = markerPositions(sensor.layers);
  if (sensor.scatter.size() != 0) markers += sensor.scatter;
  return markers;
}

Points nodePositions(const Sensor& sensor) {
  return sensor.body ? sensor.body->nodes : nodePositions(sensor.nodes);
}

Points nodeNormals(const Sensor& sensor) {
  return sensor.body ? sensor.body->normals : Points(Eigen::Vector3d::UnitZ().replicate(1, sensor.nodes.count()));
}

Eigen::VectorXd nodeAreas(const Sensor& sensor) {
  if (sensor.body) return sensor.body->areas;
  return Eigen::VectorXd::Constant(sensor.nodes.count(), sensor.nodes.pitch * sensor.nodes.pitch);
}

Eigen::MatrixXd creepCovariance(const std::vector<CreepTerm>& terms) {
  const auto count = static_cast<Eigen::Index>(terms.size());
  Eigen::MatrixXd covariance(count, count);
  for (std::size_t i = 0; i < terms.size(); ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      const auto& with = terms[i].correlation;
      const double correlation = i == j ? 1.0 : j < with.size() ? with[j] : 0.0;
      const double element = correlation * terms[i].deviation * terms[j].deviation;
      const auto row = static_cast<Eigen::Index>(i), column = static_cast<Eigen::Index>(j);
      covariance(row, column) = covariance(column, row) = element;
    }
  }
  return covariance;
}

}  // namespace sensor

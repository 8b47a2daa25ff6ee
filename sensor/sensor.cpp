#include "sensor/sensor.h"

namespace sensor {

int Sensor::markerCount() const {
  int count = 0;
  for (const MarkerLayer& layer : layers) count += layer.count();
  return count;
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

}  // namespace sensor

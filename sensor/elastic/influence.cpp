#include "sensor/elastic/influence.h"

#include "sensor/elastic/half_space.h"

namespace sensor::elastic {

Eigen::MatrixXd influenceMatrix(const Sensor& sensor, Model model, const Progress& progress) {
  const Points markers = markerPositions(sensor.layers), nodes = nodePositions(sensor.nodes);
  Eigen::MatrixXd displacement;
  if (model == Model::kBlock) {
    displacement = blockDisplacement(sensor.gel, markers, nodes, {}, progress);
  } else {
    displacement.resize(3 * markers.cols(), 3 * nodes.cols());
    for (Eigen::Index n = 0; n < nodes.cols(); ++n)
      for (Eigen::Index m = 0; m < markers.cols(); ++m)
        displacement.block<3, 3>(3 * m, 3 * n) =
            halfSpaceDisplacement(markers.col(m) - nodes.col(n), sensor.gel.youngsModulus, sensor.gel.poissonRatio);
    if (progress) progress(1.0);
  }
  const Projection projection(sensor.camera, sensor.gel.size.z());
  Eigen::MatrixXd influence(2 * markers.cols(), 3 * nodes.cols());
  for (Eigen::Index m = 0; m < markers.cols(); ++m)
    influence.middleRows<2>(2 * m) = projection.jacobian(markers.col(m)) * displacement.middleRows<3>(3 * m);
  return influence;
}

}  // namespace sensor::elastic

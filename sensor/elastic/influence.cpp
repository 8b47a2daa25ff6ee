#include "sensor/elastic/influence.h"

#include "sensor/elastic/half_space.h"
#include "sensor/elastic/parallel.h"

namespace sensor::elastic {

Eigen::MatrixXd displacementMatrix(const Gel& gel, Model model, const Points& markers, const Points& nodes, int degree,
                                   const Progress& progress) {
  if (model == Model::kBlock) return blockDisplacement(gel, markers, nodes, degree, progress);
  Eigen::MatrixXd displacement(3 * markers.cols(), 3 * nodes.cols());
  inParallel(nodes.cols(), [&](Eigen::Index n) {
    for (Eigen::Index m = 0; m < markers.cols(); ++m)
      displacement.block<3, 3>(3 * m, 3 * n) =
          halfSpaceDisplacement(markers.col(m) - nodes.col(n), gel.youngsModulus, gel.poissonRatio);
  });
  if (progress) progress(1.0);
  return displacement;
}

Eigen::MatrixXd displacementMatrix(const Sensor& sensor, Model model, const Progress& progress) {
  if (!sensor.body) {
    return displacementMatrix(sensor.gel, model, markerPositions(sensor), nodePositions(sensor), kBlockDegree,
                              progress);
  }
  if (progress) progress(1.0);
  return sensor.body->influence * (sensor.body->youngsModulus / sensor.gel.youngsModulus);
}

Eigen::MatrixXd toImage(const Sensor& sensor, const Eigen::MatrixXd& displacement) {
  const Points markers = markerPositions(sensor);
  const Projection projection(sensor.camera, sensor.gel.size.z());
  std::vector<Eigen::Matrix<double, 2, 3>> jacobians;
  for (const auto& marker : markers.colwise()) jacobians.push_back(projection.jacobian(marker));
  Eigen::MatrixXd image(2 * markers.cols(), displacement.cols());
  inParallel(image.cols(), [&](Eigen::Index column) {
    for (Eigen::Index m = 0; m < markers.cols(); ++m) {
      image.col(column).segment<2>(2 * m) =
          jacobians[static_cast<std::size_t>(m)] * displacement.col(column).segment<3>(3 * m);
    }
  });
  return image;
}

Eigen::MatrixXd pictureMotionMatrix(const Sensor& sensor) {
  const Points markers = markerPositions(sensor);
  const Projection projection(sensor.camera, sensor.gel.size.z());
  Eigen::MatrixXd motion(2 * markers.cols(), 4);
  for (Eigen::Index m = 0; m < markers.cols(); ++m) {
    motion.middleRows<2>(2 * m) = projection.motionOf(projection(markers.col(m)));
  }
  return motion;
}

}  // namespace sensor::elastic

#include "sensor/elastic/half_space.h"
#include "sensor/elastic/loads.h"
#include "sensor/elastic/matrix_cache.h"
#include "twin/gel_model.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace {

using sensor::Points;
using sensor::elastic::PatchQuadrature;
using twin::Contact;
using twin::ContactState;

/// The whole block's displacement under many points of a patch, without tables and interpolation.
Points direct(const sensor::Gel& gel, const Points& markers, const sensor::elastic::BlockCorrection& correction,
              const PatchQuadrature& patch) {
  Points sum = (correction.matrix(patch.points) * patch.forces.reshaped()).reshaped(3, markers.cols());
  for (Eigen::Index m = 0; m < markers.cols(); ++m) {
    for (Eigen::Index i = 0; i < patch.points.cols(); ++i) {
      sum.col(m) += sensor::elastic::halfSpaceDisplacement(markers.col(m) - patch.points.col(i), gel.youngsModulus,
                                                           gel.poissonRatio) *
                    patch.forces.col(i);
    }
  }
  return sum;
}

double peak(const Points& displacement) {
  return displacement.colwise().norm().maxCoeff();
}

TEST(GelModel, DisplacementIsThatOfDirectComputationAlsoBetweenTheInterpolationNodes) {
  sensor::Sensor sensor;
  for (sensor::MarkerLayer& layer : sensor.layers) {
    layer.columns = layer.rows = 9;
    layer.pitch = 8e-3;
  }
  const Points markers = sensor::markerPositions(sensor.layers);
  Contact slider{
      Contact::Shape::kHertz, 2.5e-3, {0, 1}, {{{-14e-3, -6e-3}, {0, 0, 0}, 0}, {{15e-3, 8e-3}, {0, 0, 0}, 0}}};
  Contact disc{Contact::Shape::kDisc, 8e-3, {0}, {{{10e-3, -20e-3}, {0, 0, 0}, 0}}};
  twin::GelModel model(sensor, {slider, disc});
  const sensor::elastic::BlockCorrection correction(sensor.gel, markers);
  constexpr int kRings = 9;

  const struct {
    Eigen::Vector2d position;
    Eigen::Vector3d force;
    double torque;
  } loads[] = {{{-14e-3, -6e-3}, {0, 0, 1}, 0},
               {{0.7e-3, 0.4e-3}, {1, 0, 0}, 0},
               {{7.3e-3, 5.1e-3}, {0.3, -0.8, 1.2}, 3e-3},
               {{15e-3, 8e-3}, {0, 0, 0}, 5e-3}};
  for (const auto& [position, force, torque] : loads) {
    const Points exact =
        direct(sensor.gel, markers, correction, sensor::elastic::hertz(position, slider.radius, force, kRings)) +
        direct(sensor.gel, markers, correction, sensor::elastic::twist(position, slider.radius, torque, kRings));
    const ContactState states[] = {{position, force, torque}, {disc.states[0].position, {0, 0, 0}, 0}};
    const Points fast = model.displacement(states);
    EXPECT_LT(peak(fast - exact), 2e-4 * peak(exact)) << position.transpose();
  }

  const Eigen::Vector3d force(0.5, 0.2, 1.0);
  const Points exact =
      direct(sensor.gel, markers, correction, sensor::elastic::disc(disc.states[0].position, disc.radius, force, 12));
  const ContactState states[] = {{{0, 0}, {0, 0, 0}, 0}, {disc.states[0].position, force, 0}};
  EXPECT_LT(peak(model.displacement(states) - exact), 2e-4 * peak(exact));
}

TEST(GelModel, CacheGivesTheSameAndIsNotTrustedWhenDamaged) {
  const auto directory = std::filesystem::path(testing::TempDir()) / ("twin-cache-" + std::to_string(getpid()));
  const std::vector<double> key = {1, 2, 3}, otherKey = {1, 2, 4};
  const Eigen::MatrixXd matrix = Eigen::MatrixXd::Random(7, 5);
  EXPECT_FALSE(sensor::elastic::loadMatrix(directory, key).has_value());
  ASSERT_TRUE(sensor::elastic::saveMatrix(directory, key, matrix));
  ASSERT_TRUE(sensor::elastic::loadMatrix(directory, key).has_value());
  EXPECT_EQ(*sensor::elastic::loadMatrix(directory, key), matrix);
  EXPECT_FALSE(sensor::elastic::loadMatrix(directory, otherKey).has_value());

  const std::filesystem::path file = std::filesystem::directory_iterator(directory)->path();
  const auto size = std::filesystem::file_size(file);
  {
    std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
    stream.seekp(static_cast<std::streamoff>(size) - 3);
    stream.put('x');
  }
  EXPECT_FALSE(sensor::elastic::loadMatrix(directory, key).has_value());
  std::filesystem::resize_file(file, 10);
  EXPECT_FALSE(sensor::elastic::loadMatrix(directory, key).has_value());
  std::filesystem::remove_all(directory);
}

}  // namespace

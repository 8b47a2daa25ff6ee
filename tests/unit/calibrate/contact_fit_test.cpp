#include "daemon/calibrate/contact_fit.h"
#include "sensor/elastic/half_space.h"
#include "sensor/elastic/loads.h"
#include "tests/support/places.h"
#include "tests/unit/calibrate/markers.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

namespace tractiond::calibrate::contact_fit_test {
namespace {

constexpr sensor::PictureMotion kMotion{.shift_px = 0.005, .scale = 1e-5, .roll = 1e-5};
constexpr double kMeanNoise_px = 0.004;  // mean of a second's frames, and the zero's own

/// Reads what the sensor's camera sees by the paper's mechanics.
std::optional<ContactReading> readBy(sensor::Sensor sensor, const Displacements& seen,
                                     std::span<const float> variance_px2) {
  static const ContactFit fit{sensor::Sensor{}};
  sensor.pictureMotion = kMotion;
  return fit(sensor, seen, variance_px2);
}

/// Displacements [m] of the paper's markers under the file's first load, 1 N, by finite elements that are none of ours;
/// E = 0.018 MPa. The file has column after column.
sensor::Points finiteElements() {
  const sensor::Points markers = sensor::markerPositions(sensor::Sensor{}.layers);
  std::ifstream file(test::source("tests/golden/block_reference.csv"));
  std::string cell;
  std::getline(file, cell);
  sensor::Points found(3, markers.cols());
  for (int line = 0; line < 1152; ++line) {
    const int marker = line / 576 * 576 + line % 24 * 24 + line % 576 / 24;
    for (int i = 0; i < 2; ++i) std::getline(file, cell, ',');  // load and layer
    Eigen::Matrix<double, 6, 1> mm;
    for (int i = 0; i < 6; ++i) {
      std::getline(file, cell, i < 5 ? ',' : '\n');
      mm[i] = std::stod(cell);
    }
    EXPECT_LT((1e-3 * mm.head<3>() - markers.col(marker)).norm(), 1e-9);
    found.col(marker) = 1e-3 * mm.tail<3>();
  }
  return found;
}

/// Image displacements by a camera.
Seen seenBy(const sensor::Sensor& sensor, const sensor::Points& displacement, unsigned seed) {
  const sensor::Points rest = sensor::markerPositions(sensor.layers);
  return {projected(sensor, rest + displacement) - projected(sensor, rest), kMeanNoise_px, seed};
}

TEST(ContactFit, ReadsTheFiniteElementsForceInProportionToTheModulus) {
  const sensor::Sensor sensor;
  // 1 N on a gel of 0.2 MPa, read with 0.18 MPa.
  const sensor::Points displacement = finiteElements() * 0.018 / 0.2;
  const Seen seen = seenBy(sensor, displacement, 1);
  const auto reading = readBy(sensor, seen, seen.variance_px2);
  ASSERT_TRUE(reading);
  std::printf("read %.5f +- %.5f N of 0.9, radius %.2f mm, place %.3f %.3f mm, residual %.4f px\n", reading->force.z(),
              std::sqrt(reading->covariance(2, 2)), 1e3 * reading->radius, 1e3 * reading->place.x(),
              1e3 * reading->place.y(), reading->residual_px);
  EXPECT_NEAR(reading->force.z(), 0.9, 0.005 * 0.9 + 2 * std::sqrt(reading->covariance(2, 2)));
  EXPECT_LT(reading->force.head<2>().norm(), 0.02);
  EXPECT_LT((reading->place.head<2>() - Eigen::Vector2d(0.7e-3, 0.4e-3)).norm(), 0.2e-3);
}

TEST(ContactFit, DeviationIsTrue) {
  const sensor::Sensor sensor;
  const sensor::Points displacement = finiteElements() * 0.018 / 0.18;
  double square = 0.0, claimed = 0.0;
  constexpr int kTrials = 20;
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    const Seen seen = seenBy(sensor, displacement, 10 + trial);
    const auto reading = readBy(sensor, seen, seen.variance_px2);
    ASSERT_TRUE(reading);
    square += std::pow(reading->force.z() - 1.0, 2) / kTrials;
    claimed += reading->covariance(2, 2) / kTrials;
  }
  std::printf("deviation %.5f N, claimed %.5f N\n", std::sqrt(square), std::sqrt(claimed));
  EXPECT_LT(std::sqrt(square), 1.6 * std::sqrt(claimed));
  EXPECT_GT(std::sqrt(square), 0.5 * std::sqrt(claimed));
}

TEST(ContactFit, ReadsAFlatWeightOffTheCentreByATiltedCamera) {
  sensor::Sensor sensor;
  sensor.camera.rotation = {0.01, -0.01, 0.02};
  sensor.camera.position += Eigen::Vector3d(1e-3, 0.0, 1e-3);
  const sensor::Points markers = sensor::markerPositions(sensor.layers);
  const auto patch = sensor::elastic::disc({9e-3, -6e-3}, 8e-3, {0.3, 0.0, 2.0});
  const Eigen::MatrixXd correction = sensor::elastic::BlockCorrection(sensor.gel, markers).matrix(patch.points);
  sensor::Points displacement = (correction * patch.forces.reshaped()).reshaped(3, markers.cols());
  for (Eigen::Index m = 0; m < markers.cols(); ++m) {
    for (Eigen::Index i = 0; i < patch.points.cols(); ++i) {
      displacement.col(m) += sensor::elastic::halfSpaceDisplacement(markers.col(m) - patch.points.col(i),
                                                                    sensor.gel.youngsModulus, sensor.gel.poissonRatio) *
                             patch.forces.col(i);
    }
  }
  const Seen seen = seenBy(sensor, displacement, 4);
  const auto reading = readBy(sensor, seen, seen.variance_px2);
  ASSERT_TRUE(reading);
  std::printf("flat: read %.5f N of 2 N, radius %.2f mm, residual %.4f px of %.4f\n", reading->force.z(),
              1e3 * reading->radius, reading->residual_px, reading->expected_px);
  EXPECT_NEAR(reading->force.z(), 2.0, 0.01);
  EXPECT_NEAR(reading->force.x(), 0.3, 0.01);
}

}  // namespace
}  // namespace tractiond::calibrate::contact_fit_test

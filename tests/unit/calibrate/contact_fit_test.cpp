#include "daemon/calibrate/contact_fit.h"
#include "sensor/elastic/half_space.h"
#include "sensor/elastic/loads.h"
#include "tests/support/places.h"
#include "tests/unit/calibrate/markers.h"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>

namespace tractiond::calibrate::contact_fit_test {
namespace {

constexpr sensor::PictureMotion kMotion{.shift_px = 0.005, .scale = 1e-5, .roll = 1e-5};
constexpr double kMeanNoise_px = 0.004;  // mean of a second's frames, and the zero's own

const ContactFit& paperFit() {
  static const ContactFit fit{sensor::Sensor{}};
  return fit;
}

/// Displacements [m] of the paper's markers under 1 N, by finite elements that are none of ours; E = 0.018 MPa.
sensor::Points finiteElements(const std::string& wanted) {
  const sensor::Sensor sensor;
  const sensor::Points markers = sensor::markerPositions(sensor.layers);
  std::ifstream file(test::source("tests/golden/block_reference.csv"));
  std::string line;
  std::getline(file, line);
  std::vector<std::string> names;
  std::stringstream header(line);
  for (std::string name; std::getline(header, name, ',');) names.push_back(name);
  sensor::Points found = sensor::Points::Zero(3, markers.cols());
  int rows = 0;
  while (std::getline(file, line)) {
    std::map<std::string, std::string> row;
    std::stringstream stream(line);
    std::size_t next = 0;
    for (std::string cell; std::getline(stream, cell, ',');) row[names[next++]] = cell;
    if (row["case"] != wanted) continue;
    const auto number = [&](const char* name) { return 1e-3 * std::stod(row[name]); };
    const bool red = row["layer"].find('r') != std::string::npos;
    const Eigen::Vector2d place(number("x"), number("y"));
    for (Eigen::Index i = red ? 576 : 0; i < (red ? 1152 : 576); ++i) {
      if ((markers.col(i).head<2>() - place).norm() > 1e-6) continue;
      found.col(i) = Eigen::Vector3d(number("ux"), number("uy"), number("uz"));
      ++rows;
    }
  }
  EXPECT_EQ(rows, 1152);
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
  const sensor::Points displacement = finiteElements("A") * 0.018 / 0.2;
  const Seen seen = seenBy(sensor, displacement, 1);
  const auto reading = paperFit()(sensor.camera, kMotion, seen, seen.variance_px2);
  ASSERT_TRUE(reading);
  std::printf("read %.5f +- %.5f N of 0.9, radius %.2f mm, place %.3f %.3f mm, residual %.4f px\n", reading->force.z(),
              std::sqrt(reading->covariance(2, 2)), 1e3 * reading->radius, 1e3 * reading->place.x(),
              1e3 * reading->place.y(), reading->residual_px);
  EXPECT_NEAR(reading->force.z(), 0.9, 0.005 * 0.9 + 2 * std::sqrt(reading->covariance(2, 2)));
  EXPECT_LT(reading->force.head<2>().norm(), 0.02);
  EXPECT_LT((reading->place.head<2>() - Eigen::Vector2d(0.7e-3, 0.4e-3)).norm(), 0.2e-3);
}

TEST(ContactFit, NeedsTenMarkersThatAreNotIgnored) {
  const sensor::Sensor sensor;
  const Seen seen = seenBy(sensor, finiteElements("A") * 0.018 / 0.2, 1);
  std::vector<float> variance_px2 = seen.variance_px2;
  std::fill(variance_px2.begin() + 9, variance_px2.end(), 0.0F);
  EXPECT_FALSE(paperFit()(sensor.camera, kMotion, seen, variance_px2));
}

TEST(ContactFit, DeviationIsTrue) {
  const sensor::Sensor sensor;
  const sensor::Points displacement = finiteElements("A") * 0.018 / 0.18;
  double square = 0.0, claimed = 0.0;
  constexpr int kTrials = 20;
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    const Seen seen = seenBy(sensor, displacement, 10 + trial);
    const auto reading = paperFit()(sensor.camera, kMotion, seen, seen.variance_px2);
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
  sensor::Points displacement =
      sensor::elastic::BlockCorrection(sensor.gel, markers).displacement(patch.points, patch.forces);
  for (Eigen::Index m = 0; m < markers.cols(); ++m) {
    for (Eigen::Index i = 0; i < patch.points.cols(); ++i) {
      displacement.col(m) += sensor::elastic::halfSpaceDisplacement(markers.col(m) - patch.points.col(i),
                                                                    sensor.gel.youngsModulus, sensor.gel.poissonRatio) *
                             patch.forces.col(i);
    }
  }
  const Seen seen = seenBy(sensor, displacement, 4);
  const auto reading = paperFit()(sensor.camera, kMotion, seen, seen.variance_px2);
  ASSERT_TRUE(reading);
  std::printf("flat: read %.5f N of 2 N, radius %.2f mm, residual %.4f px of %.4f\n", reading->force.z(),
              1e3 * reading->radius, reading->residual_px, reading->expected_px);
  EXPECT_NEAR(reading->force.z(), 2.0, 0.01);
  EXPECT_NEAR(reading->force.x(), 0.3, 0.01);
}

}  // namespace
}  // namespace tractiond::calibrate::contact_fit_test

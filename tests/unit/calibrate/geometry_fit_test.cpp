#include "daemon/calibrate/geometry_fit.h"
#include "tests/unit/calibrate/markers.h"

#include <gtest/gtest.h>

namespace tractiond::calibrate::geometry_fit_test {
namespace {

constexpr double kZeroNoise_px = 0.003;  // of a zero of thirty frames

/// As somebody might have mounted it.
sensor::Camera mounted(double focal = 1.001) {
  sensor::Camera camera;
  camera.focal_px *= focal;
  camera.position += Eigen::Vector3d(1.2e-3, -0.8e-3, 1.5e-3);
  camera.rotation = {0.01, -0.015, 0.02};
  camera.k1 = -0.08;
  camera.k2 = 0.02;
  return camera;
}

Seen rest(const sensor::Camera& camera, unsigned seed = 1, double noise_px = kZeroNoise_px) {
  sensor::Sensor sensor;
  sensor.camera = camera;
  return {projected(sensor, sensor::markerPositions(sensor.layers)), noise_px, seed};
}

TEST(GeometryFit, DeviationsAreTrue) {
  // Cameras and patterns as the prior says: what is found is as far from the truth as it claims.
  std::mt19937 generator(7);
  std::normal_distribution<double> normal;
  const GeometryOptions options;
  Eigen::Matrix<double, 8, 1> square = Eigen::Matrix<double, 8, 1>::Zero();
  constexpr int kTrials = 40;
  for (int trial = 0; trial < kTrials; ++trial) {
    sensor::Sensor sensor;
    const sensor::Sensor nominal;
    sensor.camera = mounted(1.0 + nominal.uncertainty.focal * normal(generator));
    sensor.camera.principal_px +=
        nominal.uncertainty.principal_px * Eigen::Vector2d(normal(generator), normal(generator));
    for (sensor::MarkerLayer& layer : sensor.layers) {
      layer.depth += options.depth * normal(generator);
      layer.pitch *= 1.0 + options.pitch * normal(generator);
    }
    sensor.layers[1].centre += options.shift * Eigen::Vector2d(normal(generator), normal(generator));
    const Seen seen(projected(sensor, sensor::markerPositions(sensor.layers)), kZeroNoise_px, 100 + trial);
    const Geometry found = fitGeometry(nominal, seen.value_px, seen.valid);
    ASSERT_EQ(found.outcome, Geometry::Outcome::kConverged);
    EXPECT_NEAR(found.residual_px, kZeroNoise_px, 0.1 * kZeroNoise_px);
    const sensor::Uncertainty& claimed = found.uncertainty;
    Eigen::Matrix<double, 8, 1> off;
    off << (found.camera.focal_px / sensor.camera.focal_px - 1.0) / claimed.focal,
        (found.camera.position - sensor.camera.position).cwiseQuotient(claimed.position),
        (found.camera.rotation - sensor.camera.rotation).cwiseQuotient(claimed.rotation),
        (found.camera.k1 - sensor.camera.k1) / found.k1Deviation;
    square += off.cwiseAbs2();
    // Focal length and distance go together.
    EXPECT_GT(claimed.focalDistance, 0.9);
  }
  const Eigen::Matrix<double, 8, 1> rms = (square / kTrials).cwiseSqrt();
  for (const double one : rms) {
    EXPECT_GT(one, 0.7) << rms.transpose();
    EXPECT_LT(one, 1.35) << rms.transpose();
  }
}

/// What was measured of the lens by itself is not fitted again by a pattern that tells less of it.
TEST(GeometryFit, BelievesALensThatWasMeasured) {
  const sensor::Camera truth = mounted(1.0);
  sensor::Sensor measured;
  measured.camera.k1 = truth.k1;
  measured.camera.k2 = truth.k2;
  measured.uncertainty.focal = 2e-4;
  measured.uncertainty.principal_px = 0.1;
  measured.uncertainty.k1 = 1e-3;
  measured.uncertainty.k2 = 5e-3;
  const Seen seen = rest(truth);
  const Geometry found = fitGeometry(measured, seen.value_px, seen.valid),
                 guessed = fitGeometry({}, seen.value_px, seen.valid);
  ASSERT_EQ(found.outcome, Geometry::Outcome::kConverged);
  EXPECT_LE(found.principalDeviation_px, 0.1);
  EXPECT_LE(found.k2Deviation, 5e-3);
  EXPECT_NEAR(found.camera.k2, truth.k2, 4 * 5e-3);
  EXPECT_LT((found.camera.principal_px - truth.principal_px).norm(), 0.5);
  // With the focal length the distance, up to the layers' own depth of 0.05 mm.
  EXPECT_LT(found.uncertainty.position.z(), 0.07e-3);
  EXPECT_GT(guessed.uncertainty.position.z(), 0.2e-3);
  EXPECT_LT(((found.camera.position - truth.position).cwiseQuotient(found.uncertainty.position)).norm(), 5.0);
}

TEST(GeometryFit, LeavesOutMarkersThatAreMisplaced) {
  Seen seen = rest(mounted());
  for (std::size_t i = 0; i < seen.valid.size(); i += 97) seen.value_px[2 * i] += 1.0F;
  for (std::size_t i = 5; i < seen.valid.size(); i += 50) {
    seen.valid[i] = 0;
    seen.value_px[2 * i] = 0.0F;
  }
  const Geometry geometry = fitGeometry({}, seen.value_px, seen.valid);
  ASSERT_EQ(geometry.outcome, Geometry::Outcome::kConverged);
  EXPECT_NEAR(geometry.residual_px, kZeroNoise_px, 0.1 * kZeroNoise_px);
  EXPECT_NEAR(geometry.outliers, 12, 1);
  EXPECT_FALSE(geometry.bulge.found());
}

TEST(GeometryFit, NoticesATouch) {
  for (const double peak : {15e-6, 45e-6, 200e-6}) {
    sensor::Sensor sensor;
    sensor.camera = mounted();
    sensor::Points points = sensor::markerPositions(sensor.layers);
    const Eigen::Vector2d touch(12e-3, -9e-3);
    for (auto point : points.colwise()) {  // a press pushes the markers aside, the farther the nearer they are
      const Eigen::Vector2d away = point.head<2>() - touch;
      point.head<2>() += peak * away / 5e-3 * std::exp(-away.squaredNorm() / (2 * 25e-6));
    }
    const Seen seen(projected(sensor, points), kZeroNoise_px, 3);
    const Geometry geometry = fitGeometry({}, seen.value_px, seen.valid);
    ASSERT_EQ(geometry.outcome, Geometry::Outcome::kConverged);
    EXPECT_TRUE(geometry.bulge.found());
    EXPECT_LT((geometry.bulge.place - touch).norm(), 10e-3);
    std::printf("bulge %.4f px, limit %.4f px\n", geometry.bulge.size_px, geometry.bulge.limit_px);
  }
}

TEST(GeometryFit, RefusesTooFewMarkers) {
  Seen seen = rest(mounted());
  std::fill(seen.valid.begin() + 11, seen.valid.end(), std::uint8_t{0});
  EXPECT_EQ(fitGeometry({}, seen.value_px, seen.valid).outcome, Geometry::Outcome::kFewMarkers);
}

TEST(GeometryFit, SaysWhenAPatternIsNoPattern) {
  Seen seen = rest(mounted());
  std::mt19937 generator(5);
  std::uniform_real_distribution<float> anywhere(0.0F, 480.0F);
  for (float& value : seen.value_px) value = anywhere(generator);
  const Geometry geometry = fitGeometry({}, seen.value_px, seen.valid);
  EXPECT_TRUE(geometry.outcome == Geometry::Outcome::kDiverged || geometry.residual_px > 10.0);
}

}  // namespace
}  // namespace tractiond::calibrate::geometry_fit_test

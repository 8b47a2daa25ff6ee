// Markers that are so near to the picture's border that their window leaves it.
#include "daemon/track/nominal.h"
#include "tests/unit/track/scene.h"

#include <gtest/gtest.h>

#include <cstdio>

namespace tractiond::track {
namespace {

constexpr int kColumns = 10, kRows = 7;
constexpr int kWidth = 320, kHeight = 240;
constexpr double kPitch_px = 31.7, kDiameter_px = 10.5;

/// A picture that a gel's dots fill; the last column is `right_px` away from its right border, the lowest row 11 px
/// from the lower one.
sensor::Sensor fullPicture(double right_px) {
  sensor::Sensor sensor;
  sensor.camera.width = kWidth;
  sensor.camera.height = kHeight;
  sensor.layers.resize(1);
  sensor::MarkerLayer& layer = sensor.layers[0];
  layer.colour = sensor::Colour::kGrey;
  layer.columns = kColumns;
  layer.rows = kRows;
  layer.centre.setZero();
  layer.diameter *= kDiameter_px / (2.0 * markerRadius(sensor, layer));
  const double mm_px = 1e-3 / (sensor.camera.focal_px / (sensor.camera.position.z() - layer.depth)) * 1e3;
  layer.pitch = kPitch_px * mm_px;
  sensor.camera.principal_px = {kWidth - right_px - 0.5 * (kColumns - 1) * kPitch_px,
                                kHeight - 11.0 - 0.5 * (kRows - 1) * kPitch_px};
  return sensor;
}

bool isNearBorder(const Eigen::Vector2d& place) {
  return place.x() > kWidth - 15.0 || place.y() > kHeight - 15.0;
}

TEST(Border, MarkersWhoseDiscIsInThePictureAreFoundWithTrueVariances) {
  Scene scene({}, twin::Format::kMono8, fullPicture(8.5));
  Started tracking(scene);
  double square = 0.0, variance = 0.0, inside = 0.0;
  int seen = 0, seenInside = 0;
  for (int frame = 0; frame < 200; ++frame) {
    scene.displace(Bump{.centre = {kWidth, kHeight}, .width_px = 150.0, .peak_px = {-0.02 * frame, 0.015 * frame}});
    tracking(scene.shoot());
    EXPECT_EQ(tracking.field.validCount, kColumns * kRows);
    for (int i = 0; i < scene.markers(); ++i) {
      const double stated = tracking.field.variance_px2[i];
      if (!isNearBorder(scene.now.col(i))) {
        inside += stated;
        ++seenInside;
        continue;
      }
      const Eigen::Vector2d found(tracking.field.displacement_px[2 * i], tracking.field.displacement_px[2 * i + 1]);
      square += (found - (scene.now.col(i) - scene.rest.col(i))).squaredNorm();
      variance += 2.0 * stated;
      ++seen;
    }
  }
  const double rms_px = std::sqrt(square / (2.0 * seen));
  std::printf("at the border: rms %.4f px, squared error over variance %.2f; variance %.2f of the others'\n", rms_px,
              square / variance, 0.5 * variance / seen / (inside / seenInside));
  EXPECT_GE(seen, 200 * (kColumns + kRows - 1));
  EXPECT_GE(square / variance, 0.8);
  EXPECT_LE(square / variance, 1.25);
}

TEST(Border, AMarkerThatIsCutIsNotFound) {
  Scene scene({}, twin::Format::kMono8, fullPicture(8.5));
  Started tracking(scene);
  scene.displace(
      [](const Eigen::Vector2d& place) { return Eigen::Vector2d(place.x() > kWidth - 15.0 ? 6.0 : 0.0, 0.0); });
  tracking(scene.shoot());
  EXPECT_EQ(tracking.field.validCount, (kColumns - 1) * kRows);
  EXPECT_EQ(compare(scene, tracking.field).wrong, 0);
}

// Where the picture has no margin, labels that are one column off hardly contradict it.
TEST(Border, AHiddenColumnDoesNotShiftAllLabels) {
  Scene scene({}, twin::Format::kMono8, fullPicture(14.5));
  Started tracking(scene);
  for (int i = 0; i < scene.markers(); ++i) {
    if (i % kColumns == kColumns - 1) scene.now.col(i).setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  tracking(scene.shoot(true));
  EXPECT_EQ(tracking.field.validCount, (kColumns - 1) * kRows);
  EXPECT_EQ(compare(scene, tracking.field).wrong, 0);
}

}  // namespace
}  // namespace tractiond::track

// Markers of a body whose layers are bent: the tracker knows them by their grids and by where they should be.
#include "sensor/influence_file.h"
#include "tests/support/fingertip.h"
#include "tests/unit/track/scene.h"

#include <gtest/gtest.h>

namespace tractiond::track::body_test {
namespace {

/// The paper's markers below a spherical cap, at equal distances along it. Its mechanics do not matter here.
sensor::Sensor cap(double radius) {
  sensor::Sensor sensor;
  sensor::Body body = test::bodyOn(sensor, {});
  for (Eigen::Index i = 0; i < body.markers.cols(); ++i) {
    const double a = body.markers(0, i) / radius, b = body.markers(1, i) / radius, r = radius - body.markers(2, i);
    body.markers.col(i) << r * std::sin(a) * std::cos(b), r * std::sin(b), radius - r * std::cos(a) * std::cos(b);
  }
  EXPECT_TRUE(sensor::setBody(sensor, std::move(body)));
  return sensor;
}

TEST(BentLayers, AreTrackedAsFlatOnesAre) {
  for (const double radius : {0.2, 0.06}) {
    Scene scene({}, twin::Format::kRgb8, cap(radius));
    // The camera is not quite where it should be; all markers stay in the picture.
    scene.rest = (0.98 * scene.rest).colwise() + Eigen::Vector2d(9.0, 3.0);
    scene.now = scene.rest;
    Started tracking(scene);
    Bump bump;
    for (int i = 0; i < 10; ++i) {
      bump.peak_px = {0.8 * i, 0.4 * i};
      scene.displace(std::cref(bump));
      tracking(scene.shoot());
    }
    const Comparison found = compare(scene, tracking.field);
    EXPECT_EQ(found.wrong, 0) << radius;
    // At 60 mm the layers' spacings differ so much that red markers hide blue ones.
    EXPECT_GE(found.valid, (radius > 0.08 ? 1.0 : 0.95) * scene.markers()) << radius;
    EXPECT_LT(found.rms_px, 0.03) << radius;
  }
}

}  // namespace
}  // namespace tractiond::track::body_test

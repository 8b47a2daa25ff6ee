// Centres against the exact truth of the renderer.
#include "daemon/track/appearance.h"
#include "tests/unit/track/scene.h"

#include <gtest/gtest.h>

namespace tractiond::track::centre_test {
namespace {

TEST(Centre, EveryFormatPutsTheSameMarkerAtTheSamePlace) {
  for (const auto format : {twin::Format::kRgb8, twin::Format::kBgr8, twin::Format::kBayerRG8, twin::Format::kBayerGR8,
                            twin::Format::kBayerGB8, twin::Format::kBayerBG8}) {
    Scene scene({}, format);
    Started tracking(scene);
    RestPose pose = tracking.takeZero();
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (int i = 0; i < scene.markers(); ++i) {
      ASSERT_TRUE(pose.present[i]);
      const Eigen::Vector2d error =
          Eigen::Vector2d(pose.position_px[2 * i], pose.position_px[2 * i + 1]) - scene.rest.col(i);
      EXPECT_LT(error.norm(), 0.06);
      mean += error / scene.markers();
    }
    EXPECT_LT(mean.norm(), 0.003) << static_cast<int>(format);
  }
}

TEST(Centre, WindowsThatLeaveThePictureFindNothing) {
  Scene scene;
  const Frame& frame = scene.shoot();
  const Plane plane = planeOf(frame, sensor::Colour::kBlue);
  const MarkerTemplate marker(1.9, 0.85);
  for (const float u :
       {-1e9F, -1.0F, 0.0F, 2.0F, 634.0F, 639.0F, 700.0F, 1e9F, std::numeric_limits<float>::quiet_NaN()}) {
    for (const float v : {-5.0F, 0.0F, 240.0F, 476.0F, 1e30F}) {
      const Guess guess{u, v, 0.0F, true};
      Centre centre;
      fitCentres(plane, marker, {0.2F, 0.2F}, {&guess, 1}, {&centre, 1});
      EXPECT_FALSE(centre.found) << u << ' ' << v;
    }
  }
}

TEST(Centre, AMarkerIsCaughtFromItsOwnRadiusAway) {
  twin::Optics optics;
  optics.readNoise = 0.5;
  Scene scene(optics);
  const Frame& frame = scene.shoot();
  const Plane plane = planeOf(frame, sensor::Colour::kBlue);
  const MarkerTemplate marker(1.9, 0.85);
  const Eigen::Vector2d place = scene.rest.col(300);
  for (int direction = 0; direction < 16; ++direction) {
    const double angle = 0.125 * 3.14159265 * direction;
    const Guess guess{static_cast<float>(place.x() + 1.9 * std::cos(angle)),
                      static_cast<float>(place.y() + 1.9 * std::sin(angle)), 20.0F, false};
    Centre centre;
    fitCentres(plane, marker, {}, {&guess, 1}, {&centre, 1});
    ASSERT_TRUE(centre.found) << direction;
    EXPECT_NEAR(centre.u, place.x(), 0.02);
    EXPECT_NEAR(centre.v, place.y(), 0.02);
  }
}

TEST(Appearance, BlurAndCrossTalkAreFoundAgain) {
  for (const double blur : {0.6, 0.8, 1.2}) {
    twin::Optics optics;
    optics.blur_px = blur;
    optics.crossTalk = 0.25;
    Scene scene(optics);
    const Frame& frame = scene.shoot();
    const Plane blue = planeOf(frame, sensor::Colour::kBlue), red = planeOf(frame, sensor::Colour::kRed);
    std::vector<Guess> places;
    for (int i = 0; i < 300; ++i) {
      places.push_back({static_cast<float>(scene.rest(0, i)), static_cast<float>(scene.rest(1, i)), 20.0F, false});
    }
    const double radius_px = 0.5 * 0.6e-3 * 960.0 / 0.151;
    Appearance::Layer layer;
    layer.radius_px = radius_px;
    fitSizes(blue, layer, places, std::vector<std::uint8_t>(places.size(), 1));
    const MarkerTemplate& marker = layer.markers.front();
    EXPECT_NEAR(crossTalkInto(blue, red, marker, places), 0.25, 0.01);
    // The pixel's own width adds 1/12 px^2 to the blur's variance.
    const MarkerTemplate expected(radius_px, std::sqrt(blur * blur + 1.0 / 12.0));
    for (const double r : {0.0, 1.0, 2.0, 3.0}) EXPECT_NEAR(marker.at(r), expected.at(r), 0.02) << blur << ' ' << r;
  }
}

}  // namespace
}  // namespace tractiond::track::centre_test

#include "daemon/track/pixel_noise.h"
#include "tests/unit/track/scene.h"

#include <gtest/gtest.h>

namespace tractiond::track::pixel_noise_test {
namespace {

float noisePerLevel(const twin::Optics& optics, twin::Format format, const std::function<double(int)>& brightness,
                    const std::function<double(int)>& shake_px) {
  Scene scene(optics, format);
  PixelNoise noise(scene.markers());
  const Lattice lattice = latticesOf(scene.sensor).front();
  std::vector<Vector> places;
  for (int i = 0; i < lattice.count(); ++i) {
    places.push_back({static_cast<float>(scene.rest(0, i)), static_cast<float>(scene.rest(1, i))});
  }
  const std::vector<std::uint8_t> valid(places.size(), 1);
  for (int frame = 0; frame < 30; ++frame) {
    scene.displace([&](const Eigen::Vector2d&) { return Eigen::Vector2d(shake_px(frame), 0.0); });
    const Frame& shot = scene.shoot(false, brightness(frame));
    noise.add(planeOf(shot, sensor::Colour::kBlue), lattice.first, places, {9.6F, 0.0F}, valid);
  }
  return noise.perLevel();
}

TEST(PixelNoise, GrowsWithTheLightAsTheCameraSays) {
  const auto steady = [](int) { return 1.0; };
  const auto still = [](int) { return 0.0; };
  for (const auto format : {twin::Format::kRgb8, twin::Format::kBayerRG8}) {
    for (const double shot : {0.0, 0.02, 0.1}) {
      twin::Optics optics;
      optics.readNoise = 1.5;
      optics.shotNoise = shot;
      EXPECT_NEAR(noisePerLevel(optics, format, steady, still), shot, 0.004);
      // Neither a flickering LED nor a trembling camera is noise of the pixels.
      EXPECT_NEAR(noisePerLevel(
                      optics, format, [](int i) { return 1.0 + 0.02 * (i % 2); }, still),
                  shot, 0.004);
      EXPECT_NEAR(noisePerLevel(optics, format, steady, [](int i) { return 0.03 * std::sin(i); }), shot, 0.004);
    }
  }
}

}  // namespace
}  // namespace tractiond::track::pixel_noise_test

// Markers made by hand: each has a size, a contrast and a shape of its own.
#include "daemon/track/centre_errors.h"
#include "daemon/track/nominal.h"
#include "daemon/track/rest_pose.h"
#include "tests/unit/track/scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <optional>
#include <string>

namespace tractiond::track {
namespace {

constexpr int kMarkers = 576;

/// One layer of dots, 24 x 24, of this diameter in the picture.
sensor::Sensor dots(double diameter_px) {
  sensor::Sensor sensor;
  sensor.layers.resize(1);
  sensor.layers[0].colour = sensor::Colour::kGrey;
  const double paper_px = 2.0 * markerRadius(sensor, sensor.layers[0]);
  sensor.layers[0].diameter *= diameter_px / paper_px;
  return sensor;
}

twin::Optics with(const twin::Variety& variety) {
  twin::Optics optics;
  optics.variety = variety;
  return optics;
}

/// A gel, its tracker, and what the tracker found.
struct Journey {
  /// `described`: the diameter that the tracker is told, relative to the true one.
  explicit Journey(const sensor::Sensor& gel, const twin::Optics& optics, double described = 1.0)
      : scene(optics, twin::Format::kMono8, gel) {
    scene.sensor.layers[0].diameter *= described;
    tracking.emplace(scene);
  }

  /// Takes a zero: how many markers are in it.
  int rest() {
    tracking->tracker.requestZero();
    for (int i = 0; i < 80; ++i) {
      (*tracking)(scene.shoot());
      if (tracking->tracker.takeRestPose(pose)) break;
    }
    return static_cast<int>(std::count(pose.present.begin(), pose.present.end(), 1));
  }

  /// Pushes the gel aside by some 7 px.
  Comparison load() {
    for (int step = 1; step <= 6; ++step) {
      scene.displace(Bump{.peak_px = Eigen::Vector2d(6.0, -4.0) * (step / 6.0)});
      (*tracking)(scene.shoot());
    }
    return compare(scene, tracking->field);
  }

  Scene scene;
  std::optional<Tracking> tracking;
  RestPose pose;
};

struct Family {
  std::string name;
  double diameter_px;
  twin::Variety variety;
  double described = 1.0;
  int least = kMarkers;  ///< to be found
};

class OwnShape : public testing::TestWithParam<Family> {};

// The ratio is that of mean squares of 1,150 coordinates, which share the motion's systematic error.
TEST_P(OwnShape, IsFoundAndTrue) {
  const Family& family = GetParam();
  Journey journey(dots(family.diameter_px), with(family.variety), family.described);
  const int found = journey.rest();
  const Comparison load = journey.load();
  std::printf("%-32s found %d, under load %d, rms %.4f px, squared error over variance %.2f\n", family.name.c_str(),
              found, load.valid, load.rms_px, load.ratio);
  EXPECT_GE(found, family.least);
  EXPECT_EQ(load.valid, found);
  EXPECT_EQ(load.wrong, 0);
  EXPECT_LE(load.ratio, 1.25);
  EXPECT_GE(load.ratio, 0.7);
}

std::vector<Family> families() {
  std::vector<Family> all;
  for (const double px : {3.8, 9.7}) {
    // Dots below 2 px, and those of less than 0.4 and more than 1.6 times the size, may be missed.
    all.push_back({std::to_string(px).substr(0, 3) + " px, sizes +-20 %", px, {.diameter = 0.2, .seed = 3}, 1.0, 568});
  }
  for (const double described : {0.8, 1.4}) {
    all.push_back({"described as " + std::to_string(described).substr(0, 4) + " times as large",
                   6.4,
                   {.diameter = 0.05, .seed = 3},
                   described});
  }
  all.push_back({"contrasts +-20 %", 6.4, {.contrast = 0.2, .seed = 3}, 1.0, 575});
  all.push_back({"large ellipses", 9.7, {.elongation = 0.5}});
  all.push_back({"all of it", 6.4, {.diameter = 0.05, .contrast = 0.1, .elongation = 0.2, .seed = 3}});
  return all;
}

INSTANTIATE_TEST_SUITE_P(Families, OwnShape, testing::ValuesIn(families()), [](const auto& one) {
  std::string name = std::to_string(one.index) + "_" + one.param.name;
  std::ranges::replace_if(
      name, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; }, '_');
  return name;
});

// A press strains discs to ellipses of another size, where noise is so small that a tenth of the radius shows.
TEST(OwnShape, ADiscThatALoadDeformsIsFound) {
  sensor::Sensor few = dots(9.7);
  few.layers[0].columns = few.layers[0].rows = 8;
  few.layers[0].pitch *= 2.0;
  twin::Optics optics;
  optics.readNoise = 1.0;
  Journey journey(few, optics);
  const int found = journey.rest();
  optics.variety = {.diameter = 0.03, .elongation = 0.15, .seed = 7};
  journey.scene.change(optics);
  for (int step = 1; step <= 10; ++step) {
    journey.scene.displace([&](const Eigen::Vector2d& place) -> Eigen::Vector2d {
      return 0.006 * step * (place - Eigen::Vector2d(319.5, 239.5));
    });
    (*journey.tracking)(journey.scene.shoot());
  }
  const Comparison load = compare(journey.scene, journey.tracking->field);
  std::printf("deformed: under load %d of %d, rms %.4f px, squared error over variance %.2f\n", load.valid, found,
              load.rms_px, load.ratio);
  EXPECT_EQ(found, 64);
  EXPECT_EQ(load.valid, found);
  EXPECT_EQ(load.wrong, 0);
  EXPECT_LE(load.rms_px, 0.02);
}

TEST(OwnShape, IsRememberedByTheZero) {
  Journey journey(dots(9.7), with({.diameter = 0.08, .elongation = 0.2, .seed = 5}));
  const int found = journey.rest();
  ASSERT_EQ(journey.pose.oddity.size(), std::size_t{kMarkers});
  EXPECT_TRUE(isSane(journey.pose));
  const int loaded = journey.load().valid;
  // Started anew, under load.
  journey.tracking.emplace(journey.scene);
  journey.tracking->tracker.restore(journey.pose);
  (*journey.tracking)(journey.scene.shoot());
  const Comparison again = compare(journey.scene, journey.tracking->field);
  EXPECT_EQ(loaded, found);
  EXPECT_GE(again.valid, found - 3);
  EXPECT_EQ(again.wrong, 0);
}

}  // namespace
}  // namespace tractiond::track

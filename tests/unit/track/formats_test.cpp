// Any format, any light, markers brighter or darker, one layer or two: the same displacements come out.
#include "daemon/track/nominal.h"
#include "tests/support/allocations.h"
#include "tests/unit/track/scene.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <string>

namespace tractiond::track::formats_test {
namespace {

using sensor::Colour;
using twin::Format;

/// The paper's layers in these styles; one where the second is not given.
struct MarkerStyle {
  Colour colour = Colour::kGrey;
  bool darker = false;
};

sensor::Sensor gel(MarkerStyle first, std::optional<MarkerStyle> second = {}) {
  sensor::Sensor sensor;
  sensor.layers[0].colour = first.colour;
  sensor.layers[0].darker = first.darker;
  if (second) {
    sensor.layers[1].colour = second->colour;
    sensor.layers[1].darker = second->darker;
  } else {
    sensor.layers.resize(1);
  }
  return sensor;
}

twin::Optics optics(double noise = 2.0) {
  twin::Optics made;
  made.background = 125.0;
  made.readNoise = noise;
  return made;
}

/// Pressed in five steps, with a picture between the pixels.
Comparison press(const sensor::Sensor& sensor, Format format, const twin::Optics& how, RestPose* pose = nullptr) {
  Scene scene(how, format, sensor);
  Tracking tracking(scene);
  if (!tracking.start(scene)) return {};
  if (pose != nullptr && !tracking.tracker.takeRestPose(*pose)) return {};
  Bump bump;
  for (int i = 1; i <= 5; ++i) {
    bump.peak_px = {1.6 * i, 0.9 * i};
    scene.displace(bump, 0.9);
    const Frame& frame = scene.shoot();
    const std::uint64_t before = support::allocations();
    tracking(frame);
    EXPECT_EQ(support::allocations(), before);
  }
  return compare(scene, tracking.field);
}

void expectTracked(const sensor::Sensor& sensor, Format format, double most_px, const std::string& name) {
  ASSERT_TRUE(trackable(sensor)) << name;
  ASSERT_TRUE(trackable(sensor, format)) << name;
  const Comparison found = press(sensor, format, optics());
  std::printf("%-40s valid %d of %d, rms %.4f px, squared / promised %.2f\n", name.c_str(), found.valid,
              sensor.markerCount(), found.rms_px, found.ratio);
  EXPECT_EQ(found.wrong, 0) << name;
  EXPECT_GE(found.valid, 0.98 * sensor.markerCount()) << name;
  EXPECT_LE(found.rms_px, most_px) << name;
  EXPECT_NEAR(found.ratio, 1.0, 0.35) << name;
}

TEST(Formats, AllAreTrackedAsEightBitsAre) {
  for (const Format format : twin::formats()) {
    const PixelFormatTraits& traits = traitsOf(format);
    const bool grey = traits.colours == PixelColours::kMono;
    expectTracked(grey ? gel({}) : sensor::Sensor{}, format, traits.isBayer() ? 0.05 : 0.025, std::string(traits.name));
  }
}

TEST(MarkerStyles, AllAreTrackedInAnyLight) {
  const std::pair<Colour, const char*> colours[] = {
      {Colour::kBlue, "blue"}, {Colour::kRed, "red"}, {Colour::kGreen, "green"}, {Colour::kGrey, "grey"}};
  for (const Format format : {Format::kMono8, Format::kBayerGR12p}) {
    for (const auto& [colour, word] : colours) {
      for (const bool darker : {false, true}) {
        expectTracked(gel({colour, darker}), format, traitsOf(format).isBayer() ? 0.05 : 0.025,
                      std::string(traitsOf(format).name) + ", " + (darker ? "darker " : "brighter ") + word);
      }
    }
  }
}

TEST(MarkerStyles, TwoLayersAreToldApart) {
  const MarkerStyle blue{Colour::kBlue, false}, red{Colour::kRed, false}, green{Colour::kGreen, false};
  const MarkerStyle darkBlue{Colour::kBlue, true}, darkGreen{Colour::kGreen, true}, darkGrey{Colour::kGrey, true};
  for (const Format format : {Format::kRgb8, Format::kBayerGR12p}) {
    const std::string name(traitsOf(format).name);
    const double most = traitsOf(format).isBayer() ? 0.055 : 0.03;
    expectTracked(gel(green, red), format, most, name + ", green and red");
    expectTracked(gel(blue, green), format, most, name + ", blue and green");
    expectTracked(gel(darkBlue, darkGreen), format, most, name + ", darker: blue and green");
    expectTracked(gel(darkBlue, red), format, most, name + ", darker blue and brighter red");
  }
  for (const Format format : {Format::kMono8, Format::kMono12p}) {
    expectTracked(gel({}, darkGrey), format, 0.025, std::string(traitsOf(format).name) + ", brighter and darker");
  }
}

TEST(MarkerStyles, ThatCannotBeToldApartAreRefused) {
  const MarkerStyle grey{}, darkGrey{Colour::kGrey, true}, red{Colour::kRed, false}, blue{Colour::kBlue, false};
  EXPECT_FALSE(trackable(gel(red, red)));
  EXPECT_FALSE(trackable(gel(grey, red)));
  EXPECT_FALSE(trackable(gel(grey, grey)));
  EXPECT_TRUE(trackable(gel(grey, darkGrey)));
  EXPECT_TRUE(trackable(gel(red, {{Colour::kRed, true}})));
  const auto refused = trackable(gel(blue, red), PixelFormat::kMono12p);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message().find("Mono12p"), std::string::npos) << refused.error().message();
  EXPECT_TRUE(trackable(gel(blue, red), PixelFormat::kBayerRG12p));
  EXPECT_TRUE(trackable(gel(red), PixelFormat::kMono8));
  EXPECT_TRUE(trackable(gel(grey, darkGrey), PixelFormat::kMono8));
}

// The noise is stated in the format's own levels, and with more bits less of it is rounding.
TEST(Formats, MoreBitsShowInTheNoise) {
  const auto noiseOf = [](Format format, double noise) {
    RestPose pose;
    EXPECT_GT(press(gel({}), format, optics(noise), &pose).valid, 500);
    return double{pose.noise} / (traitsOf(format).full() / 255.0);  // in levels of 8 bits
  };
  const double eight = noiseOf(Format::kMono8, 0.1), twelve = noiseOf(Format::kMono12p, 0.1);
  std::printf("noise of 0.1 levels: measured %.3f with 8 bits, %.3f with 12\n", eight, twelve);
  EXPECT_GE(eight, 0.25);
  EXPECT_NEAR(twelve, 0.1, 0.02);
  EXPECT_NEAR(noiseOf(Format::kMono16, 2.0), 2.0, 0.1);
  EXPECT_NEAR(noiseOf(Format::kMono10Packed, 2.0), 2.0, 0.1);
}

}  // namespace
}  // namespace tractiond::track::formats_test

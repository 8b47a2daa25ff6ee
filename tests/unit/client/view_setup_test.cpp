// What the steps of a setup compute by themselves: what a picture is worth, and the gel of a form.
#include "client/viewer/gel_form.h"
#include "client/viewer/look.h"
#include "sensor/gel_file.h"
#include "traction/error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

namespace traction::view::setup_test {
namespace {

using Json = nlohmann::ordered_json;

/// A picture whose channels have these levels, and noise.
Snapshot picture(std::uint32_t channels, const std::function<double(int u, int v, std::size_t channel)>& level,
                 double noise = 1.5) {
  Snapshot snapshot;
  snapshot.width = 320;
  snapshot.height = 240;
  snapshot.channels = channels;
  std::mt19937 random(1);
  std::normal_distribution<double> grain(0.0, noise);
  for (int v = 0; v < 240; ++v) {
    for (int u = 0; u < 320; ++u) {
      for (std::size_t channel = 0; channel < channels; ++channel) {
        snapshot.levels.push_back(
            static_cast<std::uint8_t>(std::clamp(level(u, v, channel) + grain(random), 0.0, 255.0)));
      }
    }
  }
  return snapshot;
}

/// Returns how much of a disc in a grid covers a pixel, with an edge of `blur` pixels.
double disc(int u, int v, double pitch, double radius, double blur = 1.0) {
  const double x = u - pitch * std::round(u / pitch), y = v - pitch * std::round(v / pitch);
  return std::clamp(0.5 + (radius - std::hypot(x, y)) / blur, 0.0, 1.0);
}

TEST(Look, MeasuresMarkersOfAnyColourAndContrast) {
  for (const double sign : {1.0, -1.0}) {
    for (const std::size_t shown : {0U, 2U}) {
      const Look look = lookAt(picture(3, [&](int u, int v, std::size_t channel) {
        return 120.0 + sign * (channel == shown ? 60.0 : 12.0) * disc(u, v, 17.0, 2.6);
      }));
      EXPECT_NEAR(look.markers, 18 * 14, 40);
      EXPECT_NEAR(look.diameter_px, 5.2, 0.4);
      EXPECT_NEAR(look.pitch_px, 17.0, 0.3);
    }
  }
}

TEST(Look, PixelsAreTheCamerasWhereThePictureWasReduced) {
  Snapshot snapshot = picture(1, [](int u, int v, std::size_t) { return 60.0 + 90.0 * disc(u, v, 17.0, 2.6); });
  const Look whole = lookAt(snapshot);
  snapshot.reduced = 2;
  EXPECT_EQ(lookAt(snapshot).diameter_px, 2.0 * whole.diameter_px);
  EXPECT_EQ(lookAt(snapshot).pitch_px, 2.0 * whole.pitch_px);
}

TEST(Look, SeesNoMarkersInNoiseAnEmptyPictureOrAFewSpots) {
  const auto grey = [](int, int, std::size_t) { return 80.0; };
  const auto few = [](int u, int v, std::size_t) { return 80.0 + 90.0 * disc(u, v, 110.0, 4.0); };
  for (const Snapshot& none : {picture(3, grey, 6.0), picture(1, grey, 0.0), picture(1, few), Snapshot()})
    EXPECT_EQ(lookAt(none).markers, 0);
}

TEST(Look, IsSharpestInFocus) {
  double before = INFINITY;
  for (const double blur : {1.0, 2.0, 4.0, 8.0}) {
    const auto spots = [blur](int u, int v, std::size_t) { return 40.0 + 120.0 * disc(u, v, 40.0, 9.0, blur); };
    const double sharpness = lookAt(picture(1, spots, 0.5)).sharpness;
    EXPECT_LT(sharpness, before) << blur;
    before = sharpness;
  }
}

TEST(Look, TellsWhatIsOverexposedAndHowBrightItIs) {
  const Look look = lookAt(picture(
      1, [](int u, int, std::size_t) { return u < 32 ? 300.0 : 51.0; }, 0.0));
  EXPECT_NEAR(look.clipped, 0.1, 1e-9);
  EXPECT_EQ(look.histogram.back(), 32U * 240U);
  EXPECT_EQ(look.histogram[12], 288U * 240U);
  EXPECT_EQ(look.bright, 1.0);
}

Json form() {
  return Json::parse(R"({"width_mm": 40, "height_mm": 30, "thickness_mm": 12, "youngs_modulus_kpa": 280,
      "poisson_ratio": 0.48, "gel_index": 1.41, "window": "acrylic", "window_mm": 5, "distance_mm": 90,
      "marker_depth_mm": 0.1, "marker_place_mm": 0.02, "lens_mm": 8, "pixel_um": 4, "width_px": 800, "height_px": 600,
      "layers": [{"colour": "grey", "contrast": "darker", "columns": 12, "rows": 9, "pitch_mm": 2, "depth_mm": 3,
                  "diameter_mm": 0.5, "x_mm": 1, "y_mm": -1}]})");
}

std::string refusal(const Json& form) {
  try {
    sensorOf(form, {}, false);
    return {};
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kRefused);
    return error.what();
  }
}

TEST(GelForm, BecomesAGelFileInItsUnits) {
  const sensor::Sensor described = sensorOf(form(), {}, false);
  const auto read = sensor::parseGel(sensor::gelText(described), "gel");
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_NEAR(read->gel.size.z(), 12e-3, 1e-12);
  EXPECT_NEAR(read->gel.youngsModulus, 280e3, 1e-6);
  ASSERT_EQ(read->layers.size(), 1U);
  EXPECT_TRUE(read->layers[0].darker);
  EXPECT_NEAR(read->layers[0].centre.y(), -1e-3, 1e-12);
  EXPECT_EQ(read->nodes.columns, 12);
  EXPECT_NEAR(read->nodes.centre.x(), 1e-3, 1e-12);
  EXPECT_NEAR(read->camera.focal_px, 2000.0, 1e-6);
  EXPECT_NEAR(read->camera.principal_px.x(), 399.5, 1e-9);
  EXPECT_NEAR(read->camera.windowIndex, 1.49, 1e-12);
  EXPECT_NEAR(read->camera.position.z(), 90e-3, 1e-12);
  EXPECT_NEAR(read->uncertainty.focal, 0.02, 1e-12);
}

TEST(GelForm, WhatIsMissingOrOutOfRangeIsNamedWithItsRange) {
  Json wrong = form();
  wrong["thickness_mm"] = "12";
  EXPECT_EQ(refusal(wrong), "thickness_mm is to be a number from 0.5 to 500");
  wrong = form();
  wrong["layers"][0].erase("rows");
  EXPECT_EQ(refusal(wrong), "layer 1: rows is to be a number from 4 to 200");
  wrong["layers"] = Json::array();
  EXPECT_THAT(refusal(wrong), testing::HasSubstr("one to four layers"));
  wrong["layers"] = {1};
  EXPECT_THAT(refusal(wrong), testing::HasSubstr("colour"));
  wrong = form();
  wrong["pixel_um"] = 1e308;
  EXPECT_THAT(refusal(wrong), testing::HasSubstr("pixel_um"));
}

}  // namespace
}  // namespace traction::view::setup_test

#include "tests/support/places.h"
#include "twin/film.h"

#include <gtest/gtest.h>

#include <filesystem>

namespace {

using namespace twin;

Scenario shipped(const std::string& name) {
  // The fingertip's own gel takes traction-gel minutes.
  const std::string gel = name.starts_with("fingertip") ? tractiond::test::source("config/gels/paper.toml") : "";
  const auto scenario = loadScenario(tractiond::test::source("twin/scenarios/" + name + ".toml"), gel);
  EXPECT_TRUE(scenario.has_value()) << scenario.error().where << ": " << scenario.error().what;
  return scenario.value_or(Scenario{});
}

Picture picture(double time_s, std::uint64_t number = 0) {
  Picture made;
  made.time_s = time_s;
  made.number = number;
  return made;
}

std::vector<std::string> shippedNames() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(tractiond::test::source("twin/scenarios")))
    names.push_back(entry.path().stem());
  return names;
}

TEST(Scenarios, AllAreReadableAndStartWithFourSecondsOfRest) {
  const std::vector<std::string> names = shippedNames();
  EXPECT_GE(names.size(), 8U);
  for (const std::string& name : names) {
    const Scenario scenario = shipped(name);
    for (const Contact& contact : scenario.contacts) {
      EXPECT_FALSE(contact.at(0.0).isLoaded()) << name;
      EXPECT_FALSE(contact.at(4.0).isLoaded()) << name;
      const bool isForGood = scenario.period_s > 1000;
      EXPECT_EQ(contact.at(scenario.period_s - 1e-3).isLoaded(), isForGood) << name;
    }
  }
}

TEST(Film, SameSeedSameFrameSameNoise) {
  const Scenario scenario = shipped("idle");
  GelFilm film(scenario, 7, {}), other(scenario, 8, {});
  Truth truth;
  Picture a = picture(0.0, 3), b = picture(0.0, 3), c = picture(0.0, 4), d = picture(0.0, 3);
  film.draw(a, truth);
  film.draw(b, truth);
  film.draw(c, truth);
  other.draw(d, truth);
  EXPECT_EQ(a.pixels, b.pixels);
  EXPECT_NE(a.pixels, c.pixels);
  EXPECT_NE(a.pixels, d.pixels);
}

TEST(Film, TheGelGrowsAndThePictureMovesWithTheTemperature) {
  Scenario scenario = shipped("idle");
  scenario.warmth = {.times = {0.0, 10.0},
                     .rise = {0.0, 2.0},
                     .expansion = 3e-4,
                     .shift_px = {0.1, -0.2},
                     .scale = 1e-5,
                     .roll = 2e-5};
  scenario.period_s = 20.0;
  GelFilm film(scenario, 0, {});
  Truth truth;
  Picture frame = picture(5.0);
  film.draw(frame, truth);
  EXPECT_DOUBLE_EQ(truth.rise_K, 1.0);
  // The last blue marker is at 34.5 mm in x and y: 220.8 px from the middle, right and up.
  const Eigen::Vector2d corner = truth.displacement_px.col(575);
  const double towards = 34e-3 * 3e-4 / 151e-3;  // the gel's surface grows towards the camera's other side
  EXPECT_NEAR(corner.x(), 220.8 * (3e-4 - towards + 1e-5) + 0.1 + 220.8 * 2e-5, 2e-3);
  EXPECT_NEAR(corner.y(), -220.8 * (3e-4 - towards + 1e-5) - 0.2 + 220.8 * 2e-5, 2e-3);
  frame = picture(15.0);
  film.draw(frame, truth);
  EXPECT_DOUBLE_EQ(truth.rise_K, 2.0);
  EXPECT_NEAR(truth.displacement_px(0, 575), 2.0 * corner.x(), 2e-3);
}

}  // namespace

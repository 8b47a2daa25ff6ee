#include "twin/scenario.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace {

using twin::parseScenario;
using twin::Scenario;

Scenario parsed(const std::string& text) {
  const auto result = parseScenario("format = 1\n" + text, "scenario.toml");
  EXPECT_TRUE(result.has_value()) << result.error().where << ": " << result.error().what;
  return result.value_or(Scenario{});
}

TEST(Scenario, EmptyIsThePaperAtRest) {
  const Scenario scenario = parsed("");
  EXPECT_EQ(scenario.sensor.markerCount(), 1152);
  EXPECT_EQ(scenario.format, twin::Format::kRgb8);
  EXPECT_EQ(scenario.rate_hz, 60.0);
  EXPECT_TRUE(scenario.contacts.empty());
}

TEST(Scenario, ContactsFollowTheirKeyTimes) {
  const Scenario scenario = parsed(R"(
[stream]
pixel_format = "BayerGB8"
rate_hz = 90
[optics]
contrast_levels = 80
light_slope = [0.1, -0.2]
[[contacts]]
shape = "disc"
radius_mm = 4
time_s = [2, 3, 5]
x_mm = [0, 10, 10]
y_mm = -3
force_z_n = [0, 2, 1]
torque_n_mm = [0, 4, 0]
)");
  EXPECT_EQ(scenario.format, twin::Format::kBayerGB8);
  EXPECT_EQ(scenario.rate_hz, 90.0);
  EXPECT_EQ(scenario.optics.contrast, 80.0);
  EXPECT_EQ(scenario.optics.lightSlope.y(), -0.2);
  EXPECT_EQ(scenario.period_s, 5.0);
  ASSERT_EQ(scenario.contacts.size(), 1U);
  const twin::Contact& contact = scenario.contacts[0];
  EXPECT_EQ(contact.shape, twin::Contact::Shape::kDisc);
  EXPECT_EQ(contact.radius, 4e-3);
  EXPECT_FALSE(contact.at(1.0).isLoaded());
  EXPECT_FALSE(twin::Contact{}.at(1.0).isLoaded());
  EXPECT_EQ((twin::Warmth{.times = {}, .rise = {}}.at(1.0)), 0.0);
  const twin::ContactState middle = contact.at(2.25);
  EXPECT_NEAR(middle.position.x(), 2.5e-3, 1e-15);
  EXPECT_NEAR(middle.position.y(), -3e-3, 1e-15);
  EXPECT_NEAR(middle.force.z(), 0.5, 1e-15);
  EXPECT_NEAR(middle.torque, 1e-3, 1e-15);
  EXPECT_NEAR(contact.at(4.0).force.z(), 1.5, 1e-15);
  EXPECT_EQ(contact.at(7.0).force.z(), 1.0);
}

TEST(Scenario, ResultantIsAboutTheOrigin) {
  twin::Resultant resultant;
  resultant.add({{10e-3, 20e-3}, {1, 2, 3}, 0.5});
  EXPECT_TRUE(resultant.force.isApprox(Eigen::Vector3d(1, 2, 3)));
  const Eigen::Vector3d expected = Eigen::Vector3d(10e-3, 20e-3, 0).cross(Eigen::Vector3d(1, 2, 3));
  EXPECT_TRUE(resultant.moment.isApprox(expected + Eigen::Vector3d(0, 0, 0.5)));
}

TEST(Scenario, AbsencesAreListedOrDrawn) {
  const Scenario scenario =
      parsed("[[missing]]\nfraction = 0.1\n[[missing]]\nmarkers = [3, 1151]\nfrom_s = 2\nto_s = 4\n");
  ASSERT_EQ(scenario.absences.size(), 2U);
  EXPECT_EQ(scenario.absences[0].markers.size(), 115U);
  EXPECT_EQ(scenario.absences[1].markers, (std::vector<int>{3, 1151}));
  EXPECT_EQ(scenario.absences[1].from_s, 2.0);
}

TEST(Scenario, BlemishesAreRead) {
  const Scenario scenario = parsed(R"(
[optics]
light_drift = 0.2
light_drift_period_s = 8
[[optics.highlights]]
centre_px = [100, 200]
strength_levels = 250
[[optics.highlights]]
radius_px = 30
[[optics.dust_specks]]
centre_px = [3, 4]
radius_px = 1.5
[[defocus]]
blur_px = 1.2
from_s = 2
[[tears]]
row = 99
lag_s = 0.05
from_s = 1
to_s = 1.01
[[tears]]
shift_px = -3
)");
  EXPECT_EQ(scenario.optics.drift, 0.2);
  EXPECT_EQ(scenario.optics.driftPeriod, 8.0);
  ASSERT_EQ(scenario.optics.highlights.size(), 2U);
  EXPECT_EQ(scenario.optics.highlights[0].centre_px, Eigen::Vector2d(100, 200));
  EXPECT_EQ(scenario.optics.highlights[0].strength, 250.0);
  EXPECT_EQ(scenario.optics.highlights[1].radius_px, 30.0);
  ASSERT_EQ(scenario.optics.dust.size(), 1U);
  EXPECT_EQ(scenario.optics.dust[0].radius_px, 1.5);
  ASSERT_EQ(scenario.defocuses.size(), 1U);
  EXPECT_EQ(scenario.defocuses[0].blur_px, 1.2);
  ASSERT_EQ(scenario.tears.size(), 2U);
  EXPECT_EQ(scenario.tears[0].row, 99);
  EXPECT_EQ(scenario.tears[0].lag_s, 0.05);
  EXPECT_EQ(scenario.tears[0].to_s, 1.01);
  EXPECT_EQ(scenario.tears[1].row, 240);
  EXPECT_EQ(scenario.tears[1].shift_px, -3);
}

TEST(Scenario, MistakesAreNamedWithFileAndLine) {
  const struct {
    const char *text, *where, *what;
  } cases[] = {
      {"[optics]\ncontrast = 3\n", "scenario.toml:3",
       "unknown key 'optics.contrast'; the nearest known key is 'optics.contrast_levels'"},
      {"[stream]\npixel_format = \"Mono9\"\n", "scenario.toml:3", "stream.pixel_format must be"},
      {"[[contacts]]\ntime_s = [0, 1]\n", "scenario.toml:2", "contacts[0].radius_mm is missing"},
      {"[[contacts]]\nradius_mm = 2\ntime_s = []\n", "scenario.toml:4", "contacts[0].time_s must have a time"},
      {"[warmth]\ntime_s = []\n", "scenario.toml:3", "warmth.time_s must have a time"},
      {"[[contacts]]\nradius_mm = 2\ntime_s = [0, 1, 1]\n", "scenario.toml:4", "contacts[0].time_s must be ascending"},
      {"[[contacts]]\nradius_mm = 2\ntime_s = [0, 1]\nx_mm = [0, 1, 2]\n", "scenario.toml:5",
       "contacts[0].x_mm must have as many values as time_s, 2, or one"},
      {"[[contacts]]\nradius_mm = 2\nx_mm = 49\n", "scenario.toml:3", "contacts[0].radius_mm and the position reach"},
      {"[[contacts]]\nradius_mm = -1\n", "scenario.toml:3", "contacts[0].radius_mm = -1 must be between"},
      {"[[missing]]\nfrom_s = 1\n", "scenario.toml:2", "missing[0].markers or fraction must be given"},
      {"[[missing]]\nmarkers = [1152]\n", "scenario.toml:3", "missing[0].markers = 1152 must be between 0 and 1151"},
      {"[[tears]]\nrow = 480\n", "scenario.toml:3", "tears[0].row = 480 must be between 0 and 479"},
      {"[gel]\npoisson_ratio = 0.6\n", "scenario.toml:3", "gel.poisson_ratio must be below 0.5"},
      {"contacts = 3\n", "scenario.toml:2", "contacts must be a list of tables"},
  };
  for (const auto& [text, where, what] : cases) {
    const auto result = parseScenario(std::string("format = 1\n") + text, "scenario.toml");
    ASSERT_FALSE(result.has_value()) << text;
    EXPECT_EQ(result.error().where, where) << text;
    EXPECT_EQ(result.error().what.substr(0, std::string(what).size()), what);
  }
}

}  // namespace

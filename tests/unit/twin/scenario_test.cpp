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

TEST(Scenario, OfAGelThatCreepsNobodyIsAskedHowWellThatIsKnown) {
  const Scenario scenario = parsed("[[creep]]\nshare = 0.02\ntime_s = 3\n");
  ASSERT_EQ(scenario.creep.size(), 1U);
  EXPECT_EQ(scenario.creep[0].time_s, 3.0);
}

TEST(Scenario, MistakesAreNamedWithFileAndLine) {
  const struct {
    const char *text, *where, *what;
  } cases[] = {
      {"[optics]\ncontrast = 3\n", "scenario.toml:3",
       "unknown key 'optics.contrast'; the nearest known key is 'optics.contrast_levels'"},
      {"[[contacts]]\ntime_s = [0, 1]\n", "scenario.toml:2", "contacts[0].radius_mm is missing"},
      {"[[contacts]]\nradius_mm = 2\ntime_s = [0, 1, 1]\n", "scenario.toml:4", "contacts[0].time_s must be ascending"},
      {"[[contacts]]\nradius_mm = 2\ntime_s = [0, 1]\nx_mm = [0, 1, 2]\n", "scenario.toml:5",
       "contacts[0].x_mm must have as many values as time_s, 2, or one"},
      {"[[contacts]]\nradius_mm = 2\nx_mm = 49\n", "scenario.toml:3", "contacts[0].radius_mm and the position reach"},
      {"[[missing]]\nfrom_s = 1\n", "scenario.toml:2", "missing[0].markers or fraction must be given"},
      {"gel_file = \"nowhere/tip_gel.toml\"\n", "nowhere/tip_gel.toml",
       "cannot be read: No such file or directory; `traction-gel mesh nowhere/tip.toml` makes it here, and "
       "--gel tip_gel.toml names it"},
      {"gel_file = \"tip.toml\"\n[camera]\nfocal_px = 900\n", "tip.toml", "cannot be read"},
      {"[[missing]]\nmarkers = [1152]\n", "scenario.toml:3", "missing[0].markers = 1152 must be between 0 and 1151"},
  };
  for (const auto& [text, where, what] : cases) {
    const auto result = parseScenario(std::string("format = 1\n") + text, "scenario.toml");
    ASSERT_FALSE(result.has_value()) << text;
    EXPECT_EQ(result.error().where, where) << text;
    EXPECT_EQ(result.error().what.substr(0, std::string(what).size()), what);
  }
}

}  // namespace

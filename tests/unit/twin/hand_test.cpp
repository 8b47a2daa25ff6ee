#include "tests/support/places.h"
#include "twin/hand.h"
#include "twin/scenario.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace {

using namespace twin;

constexpr double kRadius = 25e-3, kFriction = 0.5, kStep = 1e-4;
constexpr double kSlow = 1.0;  // [s] per step of 1 um: no damping

const sensor::Gel gel;
const double kNormal = gel.youngsModulus / (1 - gel.poissonRatio * gel.poissonRatio);
const double kTangential = 2 * gel.youngsModulus / ((1 + gel.poissonRatio) * (2 - gel.poissonRatio));

/// Moves by a distance along x in small steps.
void shear(RoundContact& contact, double approach, double way) {
  const int steps = static_cast<int>(std::ceil(std::abs(way) / 1e-6));
  for (int i = 0; i < steps; ++i) contact.move(approach, {way / steps, 0.0}, kSlow);
}

/// Mean squared distance of Hertz's pressures from the centre, weighted by one component of their force [m^2].
double spread(const RoundContact& contact, int component) {
  const std::vector<double> radii = RoundContact::radii();
  const Eigen::Matrix3Xd parts = contact.parts();
  double sum = 0.0;
  for (std::size_t i = 0; i < radii.size(); ++i) {
    sum += 0.4 * radii[i] * radii[i] * parts(component, static_cast<Eigen::Index>(i));
  }
  return sum / parts.row(component).sum();
}

TEST(RoundContact, BallPressesAsHertzSays) {
  RoundContact contact(gel, {0.0, kRadius}, kFriction);
  for (const double approach : {0.4e-3, 0.8e-3, 1.5e-3}) {
    contact.move(approach, {0.0, 0.0}, kStep);
    const double force = 4.0 / 3.0 * kNormal * std::sqrt(kRadius) * std::pow(approach, 1.5);
    EXPECT_NEAR(contact.force().z() / force, 1.0, 2e-3);
    EXPECT_NEAR(contact.normalForce(approach), contact.force().z(), 1e-12);
    EXPECT_NEAR(contact.radius(), std::sqrt(kRadius * approach), 0.06e-3);
    EXPECT_NEAR(contact.parts().row(2).sum() / force, 1.0, 0.01);
    EXPECT_NEAR(spread(contact, 2) / (0.4 * kRadius * approach), 1.0, 0.02);
  }
  contact.move(0.0, {0.0, 0.0}, kStep);
  EXPECT_TRUE(contact.force().isZero(0.0));
  EXPECT_TRUE(contact.parts().isZero(0.0));
}

// Cattaneo 1938, Mindlin 1949, and Mindlin and Deresiewicz 1953 for the way back.
TEST(RoundContact, BallSlipsFromItsRimAsMindlinSays) {
  const double approach = 1e-3;
  RoundContact contact(gel, {0.0, kRadius}, kFriction);
  contact.move(approach, {0.0, 0.0}, kStep);
  const double limit = kFriction * contact.force().z(), a = std::sqrt(kRadius * approach);
  const auto way = [&](double share) { return 0.75 * limit / (a * kTangential) * (1 - std::pow(1 - share, 2.0 / 3)); };
  double gone = 0.0;
  for (const double share : {0.3, 0.6, 0.9}) {
    shear(contact, approach, way(share) - gone);
    gone = way(share);
    const double c = std::cbrt(1 - share);
    EXPECT_NEAR(contact.force().x() / limit, share, 5e-3);
    EXPECT_NEAR(contact.stickRatio(), c, 0.025);
    EXPECT_NEAR(spread(contact, 0) / spread(contact, 2), (1 - std::pow(c, 5)) / (1 - std::pow(c, 3)), 0.03);
  }
  shear(contact, approach, -2 * way(0.45));
  EXPECT_NEAR(contact.force().x() / limit, 0.0, 5e-3);
  shear(contact, approach, 2 * way(1.0));
  EXPECT_NEAR(contact.force().x() / limit, 1.0, 1e-9);
  EXPECT_EQ(contact.stickRatio(), 0.0);
}

TEST(RoundContact, PressingHarderMakesItStickAgain) {
  RoundContact contact(gel, {0.0, kRadius}, kFriction);
  contact.move(1e-3, {0.0, 0.0}, kStep);
  shear(contact, 1e-3, 1e-3);
  ASSERT_EQ(contact.stickRatio(), 0.0);
  contact.move(1.2e-3, {0.0, 0.0}, kStep);
  EXPECT_GT(contact.stickRatio(), 0.9);
}

/// Closes until each finger presses with `force`, and waits.
Hand closed(HandOptions options, double force) {
  options.opening = options.width + 2e-3;
  Hand hand(options, gel);
  for (double opening = options.opening; hand.state().normal < force; opening -= 2e-6) {
    hand.command(opening, 0.0);
    hand.advance(1e-3);
  }
  hand.command(hand.state().opening, 0.0);
  hand.advance(0.2);
  return hand;
}

void lift(Hand& hand, double height, double seconds = 1.0) {
  const double opening = hand.state().opening;
  for (double to = 0.0; to < height; to += 5e-5) {
    hand.command(opening, to);
    hand.advance(5e-3);
  }
  hand.advance(seconds);
}

HandOptions egg() {
  HandOptions options;
  options.mass = 60e-3;
  options.width = 44e-3;
  options.profile = {0.0, kRadius};
  options.friction = kFriction;
  return options;
}

constexpr double kWeight = 60e-3 * 9.80665, kLeast = kWeight / 2 / kFriction;  // [N]

TEST(Hand, HoldsWhatFrictionCanCarryAndDropsTheRest) {
  Hand firm = closed(egg(), 1.15 * kLeast);
  lift(firm, 10e-3);
  EXPECT_TRUE(firm.state().lifted);
  EXPECT_FALSE(firm.state().dropped);
  EXPECT_NEAR(firm.state().slid, 0.0, 1e-6);
  EXPECT_NEAR(firm.state().carried.y(), kWeight, 1e-3 * kWeight);
  for (const int finger : {0, 1}) EXPECT_NEAR(firm.contact(finger).force().y(), -kWeight / 2, 1e-3 * kWeight);
  EXPECT_GT(firm.state().clearance, 9e-3);

  Hand loose = closed(egg(), 0.85 * kLeast);
  lift(loose, 10e-3, 3.0);
  EXPECT_LT(loose.state().clearance, 1e-3);  // it slid down to the table, or never left it
}

TEST(Hand, DropsWhatItLetsGoInTheAirAndNotWhatItPutsDown) {
  Hand air = closed(egg(), 1.3 * kLeast);
  lift(air, 10e-3);
  air.command(60e-3, 10e-3);
  air.advance(1.0);
  EXPECT_TRUE(air.state().dropped);
  EXPECT_NEAR(air.state().clearance, 0.0, 1e-4);

  Hand table = closed(egg(), 1.3 * kLeast);
  lift(table, 10e-3);
  table.command(table.state().opening, 0.0);
  table.advance(1.0);
  table.command(60e-3, 0.0);
  table.advance(1.0);
  EXPECT_FALSE(table.state().dropped);
}

TEST(Hand, BreaksWhatIsPressedTooHard) {
  HandOptions options = egg();
  options.breaking = 2.0;
  EXPECT_FALSE(closed(options, 1.9).state().broken);
  EXPECT_TRUE(closed(options, 2.1).state().broken);
}

// A hand that holds with a margin of 1.5 loses the object where the disturbance takes more than that.
TEST(Hand, DisturbancesCountFromTheLift) {
  const auto slides = [](const Disturbance& disturbance) {
    HandOptions options = egg();
    options.disturbances = {disturbance};
    Hand hand = closed(options, 1.5 * kLeast);
    lift(hand, 20e-3, 2.0);
    return hand.state().slid > 1e-5;
  };
  EXPECT_FALSE(slides({.at_s = 2, .mass = 0.2 * 60e-3}));
  EXPECT_TRUE(slides({.at_s = 2, .mass = 0.6 * 60e-3}));
  EXPECT_FALSE(slides({.at_s = 2, .duration_s = 0.3, .acceleration = {0, 0.3 * 9.81}}));
  EXPECT_TRUE(slides({.at_s = 2, .duration_s = 0.3, .acceleration = {0, 0.9 * 9.81}}));
  EXPECT_FALSE(slides({.at_s = 2, .duration_s = 0.3, .force = {0.4 * kWeight, 0}}));
  EXPECT_TRUE(slides({.at_s = 2, .duration_s = 0.3, .force = {0, -1.0 * kWeight}}));
}

TEST(Hand, ObjectShiftsBothGelsTheSameWay) {
  HandOptions options = egg();
  options.disturbances = {{.at_s = 1, .duration_s = 5.0, .force = {0.2, 0.0}}};
  Hand hand = closed(options, 1.5);
  lift(hand, 10e-3, 2.0);
  EXPECT_GT(hand.contact(1).force().x(), 0.02);
  EXPECT_NEAR(hand.contact(0).force().x(), -hand.contact(1).force().x(), 1e-9);
  EXPECT_NEAR(hand.contact(0).force().y(), hand.contact(1).force().y(), 1e-9);
  EXPECT_EQ(hand.position(0).x(), -hand.position(1).x());
}

TEST(Scenario, GripperAndObjectMakeAHand) {
  const auto scenario = loadScenario(tractiond::test::source("twin/scenarios/egg.toml"));
  ASSERT_TRUE(scenario) << scenario.error().what;
  ASSERT_TRUE(scenario->hand);
  EXPECT_NEAR(scenario->hand->mass, 60e-3, 1e-12);
  EXPECT_NEAR(scenario->hand->profile.curvature, 25e-3, 1e-12);
  EXPECT_EQ(scenario->hand->disturbances.size(), 1U);
  EXPECT_EQ(scenario->contacts.size(), RoundContact::radii().size());

  const auto both = parseScenario("format = 1\n[object]\n[[contacts]]\nradius_mm = 4\n", "both.toml");
  ASSERT_FALSE(both);
  EXPECT_EQ(both.error().what, "object and contacts exclude each other: the object makes the contacts");
  const auto soft = parseScenario("format = 1\n[object]\nstiffness_n_mm = 2\nshape = \"box\"\n", "soft.toml");
  ASSERT_TRUE(soft);
  EXPECT_NEAR(soft->hand->stiffness, 2e3, 1e-9);
  EXPECT_GT(soft->hand->profile.flat, 1e-3);
}

}  // namespace

#include "tests/support/seed.h"
#include "touch/partial_slip.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace touch {
namespace {

/// Mindlin's shear at a distance from the centre, of a contact of radius 1.
double shear(double r, double stickRatio) {
  const double all = std::sqrt(std::fmax(0.0, 1.0 - r * r));
  const double inside = r < stickRatio ? std::sqrt(stickRatio * stickRatio - r * r) : 0.0;
  return all - inside;
}

/// Integral over the disc of the shear times a power of the distance.
double moment(double stickRatio, int power) {
  constexpr int kSteps = 20'000;
  double sum = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const double r = (i + 0.5) / kSteps;
    sum += shear(r, stickRatio) * std::pow(r, power + 1) / kSteps;
  }
  return sum;
}

TEST(PartialSlip, ShearIsSpreadAsMindlinsTractionsAre) {
  const double pressure = moment(0.0, 2) / moment(0.0, 0);
  for (const double stickRatio : {0.0, 0.3, 0.67, 0.9})
    EXPECT_NEAR(spreadRatio(stickRatio), moment(stickRatio, 2) / moment(stickRatio, 0) / pressure, 1e-4);
  EXPECT_DOUBLE_EQ(spreadRatio(1.0), 5.0 / 3.0);
}

/// What a contact at rest shows.
std::optional<Slip> atRest(const Observation& contact) {
  return PartialSlip().see(contact, 1, {}, {1e-4, 1e-4});
}

/// A contact of 4 N at a share of the shear at which it slips.
Observation sheared(double share, double friction, double ratioDeviation) {
  Observation contact;
  contact.force_N = {share * friction * 4.0, 0.0, 4.0};
  contact.forceDeviation_N = {0.01, 0.01, 0.01};
  contact.spreadRatio = spreadRatio(std::cbrt(1.0 - share));
  contact.spreadRatioDeviation = ratioDeviation;
  return contact;
}

TEST(PartialSlip, FindsFrictionBeforeAContactSlips) {
  const Slip slip = atRest(sheared(0.7, 0.5, 0.03)).value();
  EXPECT_NEAR(slip.friction.estimate, 0.5, 0.04);
  EXPECT_NEAR(slip.stickRatio.estimate, std::cbrt(0.3), 0.05);
  EXPECT_LT(slip.incipient, 0.05);
  EXPECT_GT(atRest(sheared(0.98, 0.5, 0.03)).value().incipient, 0.8);
}

TEST(PartialSlip, ShowsALowerBoundOnlyWhereLittleSlips) {
  const Slip slip = atRest(sheared(0.2, 0.5, 0.1)).value();
  EXPECT_GT(slip.friction.low, 0.1);
  EXPECT_GT(slip.friction.high, 0.9 * kLargestFriction);
}

TEST(PartialSlip, IsNotKnownWithoutShearOrSpread) {
  EXPECT_FALSE(atRest(sheared(0.7, 0.5, 0.0)));
  Observation faint = sheared(0.7, 0.5, 0.03);
  faint.forceDeviation_N[0] = faint.force_N[0];
  EXPECT_FALSE(atRest(faint));
  EXPECT_FALSE(atRest({}));
}

TEST(PartialSlip, IntervalsCover) {
  std::mt19937 random(tractiond::test::seed());
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  int friction = 0, stick = 0;
  constexpr int kRuns = 2000;
  for (int run = 0; run < kRuns; ++run) {
    const double truth = 0.2 * std::exp(std::log(5.0) * uniform(random)), share = 0.4 + 0.6 * uniform(random);
    Observation contact = sheared(share, truth, 0.05);
    contact.spreadRatio += contact.spreadRatioDeviation * normal(random);
    for (const std::size_t i : {0, 2}) contact.force_N[i] += contact.forceDeviation_N[i] * normal(random);
    const Slip slip = atRest(contact).value();
    const double ratio = std::cbrt(1.0 - share);
    friction += slip.friction.low <= truth && truth <= slip.friction.high;
    stick += slip.stickRatio.low <= ratio && ratio <= slip.stickRatio.high;
  }
  EXPECT_GT(friction, 0.93 * kRuns);
  EXPECT_GT(stick, 0.93 * kRuns);
}

}  // namespace
}  // namespace touch

#include "tests/support/seed.h"
#include "touch/partial_slip.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <random>
#include <utility>

namespace touch {
namespace {

TEST(PartialSlip, ShearIsSpreadAsMindlinsTractionsAre) {
  for (const double stickRatio : {0.0, 0.3, 0.67, 0.9})
    EXPECT_NEAR(spreadRatio(stickRatio), (1.0 - std::pow(stickRatio, 5)) / (1.0 - std::pow(stickRatio, 3)), 1e-12);
  EXPECT_DOUBLE_EQ(spreadRatio(1.0), 5.0 / 3.0);
}

/// What a contact at rest shows.
std::optional<Slip> atRest(const Observation& contact) {
  return PartialSlip().see(contact, 1, {.wayDeviation_m = {1e-4, 1e-4}});
}

/// A contact of 4 N at a share of the shear at which it slips.
Observation sheared(double share, double friction, double ratioDeviation) {
  Observation contact;
  contact.force_N = {share * friction * 4.0, 0.0, 4.0};
  contact.forceDeviation_N = {0.01, 0.01, 0.01};
  contact.shearSpreadRatio = spreadRatio(std::cbrt(1.0 - share));
  contact.shearSpreadRatioDeviation = ratioDeviation;
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

TEST(PartialSlip, IsNotKnownWithoutLoad) {
  Observation faint = sheared(0.7, 0.5, 0.03);
  faint.forceDeviation_N[0] = faint.force_N[0];
  EXPECT_FALSE(atRest(faint));
  EXPECT_FALSE(atRest({}));
}

/// Shows a contact in frames of 60 Hz, one after the other.
class Frames {
 public:
  std::optional<Slip> see(const Observation& contact, const std::array<double, 2>& moved_m = {},
                          double turn_rad = 0.0) {
    time_ns_ += 16'666'667;
    return slip_.see(contact, time_ns_, {moved_m, {1e-5, 1e-5}, turn_rad, 0.01});
  }
  std::optional<Slip> see(const Observation& contact, int frames) {
    for (int i = 1; i < frames; ++i) see(contact);
    return see(contact);
  }

 private:
  PartialSlip slip_;
  std::int64_t time_ns_ = 1'000'000'000;
};

double width(const Slip& slip) {
  return std::log(slip.friction.high / slip.friction.low);
}

TEST(PartialSlip, ManyFramesSayMoreButNotWhatStays) {
  Frames frames;
  const Observation contact = sheared(0.7, 0.5, 0.05);
  const double one = width(frames.see(contact).value()), many = width(frames.see(contact, 30).value());
  EXPECT_LT(many, 0.8 * one);
  EXPECT_NEAR(width(frames.see(contact, 300).value()), many, 0.01);
  EXPECT_GT(many, 0.3 * one);
}

TEST(PartialSlip, AlarmsBeforeTheContactSlipsAndNotWhileItSticks) {
  Frames frames;
  double at = 1.0;
  for (double share = 0.2; share < 1.0; share += 0.01) {
    if (frames.see(sheared(share, 0.5, 0.03)).value().state != SlipState::kIncipient) continue;
    at = share;
    break;
  }
  EXPECT_GT(at, 0.75);
  EXPECT_LT(at, 0.9);
}

TEST(PartialSlip, OneFrameThatIsOffRaisesNoAlarm) {
  Frames frames;
  EXPECT_EQ(frames.see(sheared(0.5, 0.5, 0.03), 10).value().state, SlipState::kSticking);
  Observation off = sheared(0.5, 0.5, 0.003);
  off.shearSpreadRatio = 1.0;
  EXPECT_EQ(frames.see(off).value().state, SlipState::kSticking);
}

TEST(PartialSlip, ShearThatFallsSaysNothingNewOfTheFriction) {
  Frames frames;
  const Slip before = frames.see(sheared(0.85, 0.5, 0.03), 10).value();
  Observation less = sheared(0.5, 0.5, 0.03);
  less.shearSpreadRatio = 0.9;  // the rim slips back
  const Slip after = frames.see(less, 10).value();
  EXPECT_NEAR(after.friction.estimate, before.friction.estimate, 0.02);
  EXPECT_EQ(after.state, SlipState::kSticking);
  EXPECT_NEAR(after.margin_N, 4.0 * after.friction.estimate - 1.0, 1e-9);
}

TEST(PartialSlip, IsNotKnownLongAfterTheLastSpread) {
  Frames frames;
  const Observation known = sheared(0.85, 0.5, 0.03), unknown = sheared(0.85, 0.5, 0.0);
  frames.see(known, 10);
  EXPECT_EQ(frames.see(unknown, 5).value().model, SlipModel::kBall);
  EXPECT_EQ(frames.see(unknown, 15).value().model, SlipModel::kBound);
  EXPECT_EQ(frames.see(known).value().model, SlipModel::kBall);
  Observation less = unknown;
  less.force_N[0] *= 0.5;
  EXPECT_EQ(frames.see(less, 60).value().model, SlipModel::kBall) << "the friction is still that which it was";
}

TEST(PartialSlip, AContactThatGrewMuchStrongerIsLearntAnew) {
  Frames frames;
  Observation faint = sheared(0.9, 1.0, 0.3);
  for (double& force_N : faint.force_N) force_N *= 0.1;
  frames.see(faint, 3);
  EXPECT_NEAR(frames.see(sheared(0.8, 0.5, 0.03), 10).value().friction.estimate, 0.5, 0.04);
}

TEST(PartialSlip, WhatWasKnownOfAnotherPlaceIsForgotten) {
  Frames frames;
  frames.see(sheared(0.8, 0.9, 0.03), 10);
  for (int i = 0; i < 2; ++i) frames.see(sheared(0.8, 0.3, 0.03), {0.0, 1e-3});
  const Observation there = sheared(0.8, 0.3, 0.03);
  EXPECT_NEAR(frames.see(there, 2).value().friction.estimate, 0.3, 0.04);
}

/// A contact of 4 N, round with even pressure, no ball.
/// \param torque_N torque over its lever
Observation borne(double shear_N, double torque_N = 0.0) {
  Observation contact;
  contact.force_N = {shear_N, 0.0, 4.0};
  contact.forceDeviation_N = {0.01, 0.01, 0.01};
  contact.halfAxes_m = {5e-3, 5e-3};
  contact.moment_Nm[2] = torque_N * 0.75 * 5e-3;
  contact.momentCovariance_N2m2.noise[8] = 1e-10;
  return contact;
}

TEST(PartialSlip, WhatAnyContactBearsIsALowerBound) {
  for (const auto& [shear_N, torque_N] : {std::pair{1.0, 0.0}, {0.6, 0.8}, {0.0, 1.0}}) {
    const Slip slip = atRest(borne(shear_N, torque_N)).value();
    EXPECT_EQ(slip.model, SlipModel::kBound);
    EXPECT_EQ(slip.state, SlipState::kUnknown);
    EXPECT_LT(slip.friction.low, 0.25);
    EXPECT_GT(slip.friction.low, 0.25 * 0.7);
    EXPECT_EQ(slip.friction.high, kLargestFriction);
    EXPECT_EQ(slip.margin_N, 0.0);
    EXPECT_GT(slip.holdingForce_N, 4.0);
  }
}

TEST(PartialSlip, WhatAContactHasBorneItBearsAgain) {
  Frames frames;
  frames.see(borne(2.0));
  EXPECT_NEAR(frames.see(borne(0.5)).value().margin_N, 1.5, 0.06);
}

/// Frames of a contact that slides along x with a friction of 0.5.
void slide(Frames& frames, int count = 10) {
  for (int i = 0; i < count; ++i) frames.see(borne(2.0), {1e-3, 1e-4});
}

TEST(PartialSlip, AContactThatSlidShowsItsFriction) {
  Frames frames;
  slide(frames);
  EXPECT_EQ(frames.see(borne(2.0), {1e-3, 0.0}).value().state, SlipState::kSlipping);
  const Slip held = frames.see(borne(1.2), 600).value();
  EXPECT_EQ(held.model, SlipModel::kSliding);
  EXPECT_EQ(held.state, SlipState::kSticking);
  EXPECT_NEAR(held.friction.estimate, 0.5, 0.01);
  EXPECT_LT(held.friction.low, 0.5);
  EXPECT_GT(held.friction.high, 0.5);
  EXPECT_LT(held.friction.high / held.friction.low, 1.25);
  EXPECT_NEAR(held.margin_N, 0.8, 0.04);
  EXPECT_NEAR(held.holdingForce_N, 1.25 * 1.2 / held.friction.low, 1e-9);
  EXPECT_EQ(frames.see(borne(1.85), 3).value().state, SlipState::kIncipient);
  Observation pressed = borne(1.2);
  pressed.force_N[2] = 12.0;
  EXPECT_GT(width(frames.see(pressed).value()), 1.5 * width(held)) << "friction may depend on the normal force";
}

TEST(PartialSlip, AContactThatTurnedShowsItsFriction) {
  Frames frames;
  for (int i = 0; i < 10; ++i) frames.see(borne(0.0, -2.0), {}, -0.2);
  const Slip slip = frames.see(borne(0.5)).value();
  EXPECT_EQ(slip.model, SlipModel::kSliding);
  EXPECT_NEAR(slip.friction.estimate, 0.5, 0.04);
}

TEST(PartialSlip, OnlyMotionAlongTheLoadIsASlide) {
  Frames frames;
  for (int i = 0; i < 10; ++i) frames.see(borne(2.0), {0.0, 1e-3});
  EXPECT_EQ(frames.see(borne(2.0)).value().model, SlipModel::kBound);
  for (int i = 0; i < 10; ++i) frames.see(borne(0.0, 2.0), {}, -0.2);
  EXPECT_EQ(frames.see(borne(2.0)).value().model, SlipModel::kBound);
  slide(frames);
  for (int i = 0; i < 30; ++i) frames.see(borne(0.5), {0.0, 1e-3});
  EXPECT_EQ(frames.see(borne(2.0)).value().model, SlipModel::kBound) << "it is elsewhere";
}

TEST(PartialSlip, FrictionOfASlideIsNotThatOfShearThatWasLetGo) {
  Frames frames;
  slide(frames);
  for (double shear_N = 2.0; shear_N > 0.2; shear_N *= 0.8) frames.see(borne(shear_N), {1e-3, 0.0});
  frames.see(borne(-0.5), {1e-3, 0.0});
  EXPECT_NEAR(frames.see(borne(0.5)).value().friction.estimate, 0.5, 0.03);
}

TEST(PartialSlip, AContactThatBearsMoreHasNotSlid) {
  Frames frames;
  slide(frames);
  EXPECT_EQ(frames.see(borne(3.0), 2).value().model, SlipModel::kBound);
}

TEST(PartialSlip, SpreadOfTheShearSaysNothingUnderTorque) {
  Observation contact = borne(1.0, 0.8);
  contact.shearSpreadRatio = 1.0;
  contact.shearSpreadRatioDeviation = 0.03;
  EXPECT_EQ(atRest(contact).value().model, SlipModel::kBound);
}

}  // namespace
}  // namespace touch

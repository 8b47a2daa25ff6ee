#include "touch/contact_tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>
#include <random>
#include <utility>
#include <vector>

namespace touch {
namespace {

constexpr std::int64_t kFrame_ns = 16'666'667;

Observation at(double x_mm, double y_mm, double force_N = 1.0) {
  return {{1e-3 * x_mm, 1e-3 * y_mm}, {5e-5, 5e-5}, {0.1, 0.0, force_N}, {0.01, 0.01, 0.02}, 3e-5, 1e-6, 0.0, 0.0};
}

/// A tracker and a sensor whose frames follow each other at 60 frames/s.
struct Bench {
  ContactTracker tracker;
  Field field{1'000'000'000, true, false, {}, {}};

  std::vector<Contact> see(std::vector<Observation> contacts, int frames = 1) {
    field.valid = true;
    field.contacts = std::move(contacts);
    return pass(frames);
  }
  std::vector<Contact> seeNothingValid(int frames = 1) {
    field.valid = false;
    field.contacts.clear();
    return pass(frames);
  }
  std::vector<Contact> pass(int frames) {
    std::vector<Contact> last;
    for (; frames > 0; --frames) {
      field.time_ns += kFrame_ns;
      last = tracker.update(field);
    }
    return last;
  }
};

using Reported = std::vector<std::pair<std::uint64_t, ContactPhase>>;

Reported phases(const std::vector<Contact>& contacts) {
  Reported result;
  for (const Contact& one : contacts) result.emplace_back(one.id, one.phase);
  return result;
}

using Causes = std::vector<std::pair<std::uint64_t, EndCause>>;

/// Returns those that end.
Causes causes(const std::vector<Contact>& contacts) {
  Causes result;
  for (const Contact& one : contacts) {
    if (one.endCause != EndCause::kNone) result.emplace_back(one.id, one.endCause);
  }
  return result;
}

TEST(Tracker, AContactBeginsMovesAndEnds) {
  Bench bench;
  EXPECT_EQ(phases(bench.see({at(0, 0)})), (Reported{{1, ContactPhase::kBegin}}));
  const std::int64_t begun_ns = bench.field.time_ns;
  const Contact contact = bench.see({at(1, 0)}, 3).front();
  EXPECT_EQ(contact.phase, ContactPhase::kMove);
  EXPECT_EQ(contact.begun_ns, begun_ns);
  EXPECT_EQ(contact.seen_ns, begun_ns + 3 * kFrame_ns);
  EXPECT_EQ(contact.position_m, at(1, 0).position_m);
  EXPECT_EQ(contact.force_N, at(1, 0).force_N);
  EXPECT_EQ(contact.forceDeviation_N, at(1, 0).forceDeviation_N);
  EXPECT_NEAR(contact.radius_m, std::sqrt(3e-5 / std::numbers::pi), 1e-12);
  EXPECT_NEAR(contact.radiusDeviation_m / contact.radius_m, 0.5 / 30, 1e-9);  // half of the area's, relative

  const Contact absent = bench.see({}, 5).front();
  EXPECT_EQ(absent.phase, ContactPhase::kAbsent);
  EXPECT_EQ(absent.force_N, (std::array<double, 3>{}));
  EXPECT_EQ(absent.position_m, contact.position_m);
  EXPECT_EQ(phases(bench.see({})), (Reported{{1, ContactPhase::kEnd}}));  // 6 frames are 100.000002 ms
  EXPECT_TRUE(bench.see({}).empty());
}

TEST(Tracker, ALongContactTurnsThroughHalfTurnsAndARoundOneIsNotSaidTo) {
  Bench bench;
  Observation bar = at(0, 0);
  bar.orientationDeviation_rad = 0.02;
  Contact contact;
  for (int frame = 0; frame < 120; ++frame) {  // one turn in the two seconds, to the right: past -pi/2 twice
    bar.orientation_rad = std::remainder(-2.0 * std::numbers::pi * frame / 120, std::numbers::pi);
    contact = bench.see({bar}).front();
    EXPECT_EQ(contact.orientation_rad, bar.orientation_rad);
    if (frame > 20) {
      EXPECT_NEAR(contact.angularVelocity_rad_s, -std::numbers::pi, 0.1) << frame;
    }
  }
  EXPECT_LT(contact.angularVelocityDeviation_rad_s, 2.0);
  bar.orientationDeviation_rad = std::numbers::pi / std::sqrt(12.0);
  contact = bench.see({bar}).front();
  EXPECT_EQ(contact.angularVelocity_rad_s, 0.0);
  EXPECT_EQ(contact.angularVelocityDeviation_rad_s, ContactTracker::kTurn_rad_s);
}

TEST(Tracker, ATouchWithin100MsAndReachIsTheSameContact) {
  Bench bench;
  bench.see({at(0, 0)}, 10);
  bench.see({}, 4);
  EXPECT_EQ(phases(bench.see({at(4, 0)})), (Reported{{1, ContactPhase::kMove}}));
  bench.see({}, 4);
  EXPECT_EQ(phases(bench.see({at(14, 0)})),
            (Reported{{1, ContactPhase::kAbsent}, {2, ContactPhase::kBegin}}));  // too far away
  bench.see({}, 4);
  EXPECT_EQ(phases(bench.see({at(14, 1)})), (Reported{{2, ContactPhase::kMove}}));
  bench.see({}, 6);
  EXPECT_EQ(phases(bench.see({at(14, 1)})), (Reported{{3, ContactPhase::kBegin}}));  // too late
}

TEST(Tracker, NoContactIsFasterThanTheGreatestSpeed) {
  Bench bench;
  bench.see({at(0, 0)}, 10);
  EXPECT_EQ(phases(bench.see({at(7, 0)})), (Reported{{1, ContactPhase::kAbsent}, {2, ContactPhase::kBegin}}));
  Bench moving;  // at 0.45 m/s, from its first field on
  for (int frame = 0; frame < 12; ++frame) {
    EXPECT_EQ(moving.see({at(7.5 * frame - 45, 0)}).back().id, 1U);
  }
}

TEST(Tracker, ContactsThatBecomeOneContinueTheStrongerAndPartAgain) {
  Bench bench;
  bench.see({at(-4, 0, 2.0), at(4, 0, 1.0)}, 10);
  const Observation both = at(-4.0 / 3, 0, 3.0);
  EXPECT_EQ(phases(bench.see({both})), (Reported{{1, ContactPhase::kMove}, {2, ContactPhase::kAbsent}}));
  bench.see({both}, 3);
  EXPECT_EQ(phases(bench.see({at(4, 0, 2.0), at(-4, 0, 1.0)})),
            (Reported{{1, ContactPhase::kMove}, {2, ContactPhase::kMove}}));
  EXPECT_EQ(bench.see({at(4, 0, 2.0), at(-4, 0, 1.0)})[1].force_N[2], 2.0);  // 2 is the one on the right
  EXPECT_EQ(phases(bench.see({both}, 7)), (Reported{{1, ContactPhase::kMove}}));
  EXPECT_EQ(phases(bench.see({at(-4, 0, 2.0), at(4, 0, 1.0)})),
            (Reported{{1, ContactPhase::kMove}, {3, ContactPhase::kBegin}}));
}

TEST(Tracker, AWideContactMayJumpByItsRadius) {
  Bench bench;
  Observation wide = at(0, 0);
  wide.area_m2 = std::numbers::pi * 15e-3 * 15e-3;
  bench.see({wide}, 10);
  wide.position_m[0] = 12e-3;
  EXPECT_EQ(phases(bench.see({wide})), (Reported{{1, ContactPhase::kMove}}));
  wide.position_m[0] = 30e-3;
  EXPECT_EQ(phases(bench.see({wide})), (Reported{{1, ContactPhase::kAbsent}, {2, ContactPhase::kBegin}}));
}

TEST(Tracker, FieldsThatAreNotValidOrMissingEndNoContactThatIsWhereItWas) {
  Bench bench;
  for (int frame = 0; frame < 10; ++frame) bench.see({at(3 * frame, 0)});  // 0.18 m/s
  const std::vector<Contact> unknown = bench.seeNothingValid(3);
  EXPECT_EQ(phases(unknown), (Reported{{1, ContactPhase::kUnknown}}));
  EXPECT_EQ(unknown.front().force_N, (std::array<double, 3>{}));
  EXPECT_EQ(phases(bench.see({at(39, 0)})), (Reported{{1, ContactPhase::kMove}}));  // where it was going
  bench.field.time_ns += 3 * kFrame_ns;                                             // without a field
  EXPECT_EQ(phases(bench.see({at(51, 0)})), (Reported{{1, ContactPhase::kMove}}));
  EXPECT_EQ(phases(bench.seeNothingValid(50)), (Reported{{1, ContactPhase::kUnknown}}));
  EXPECT_EQ(phases(bench.see({at(52, 0)})), (Reported{{1, ContactPhase::kMove}})) << "where it was";
  bench.field.time_ns += 50 * kFrame_ns;
  EXPECT_EQ(phases(bench.see({at(52, 0)})), (Reported{{1, ContactPhase::kMove}}));
  bench.seeNothingValid(20);
  EXPECT_EQ(phases(bench.see({at(62, 0)})), (Reported{{1, ContactPhase::kAbsent}, {2, ContactPhase::kBegin}}))
      << "it may be another one";
  EXPECT_EQ(causes(bench.see({at(62, 0)})), (Causes{{1, EndCause::kLifted}}));
  EXPECT_EQ(causes(bench.seeNothingValid(60)), (Causes{{2, EndCause::kNotSeen}}));
  EXPECT_EQ(phases(bench.see({at(62, 0)})), (Reported{{3, ContactPhase::kBegin}}));
}

TEST(Tracker, APressKeepsItsIdAtAnyRateAndHoweverLateFieldsAre) {
  for (const std::int64_t interval_ns : {5'000'000, 16'666'667, 100'000'000, 500'000'000, 1'000'000'000}) {
    SCOPED_TRACE(interval_ns);
    std::mt19937 random(1);
    Bench bench;
    std::uint64_t id = 0;
    for (int frame = 0; frame < 200; ++frame) {
      bench.field.time_ns += interval_ns - kFrame_ns + static_cast<std::int64_t>(random() % 1000) * interval_ns / 4000;
      id = bench.see({at(0.1 * static_cast<double>(random() % 3), 0)}).back().id;
      if (random() % 10 != 0) continue;
      bench.field.time_ns += 300'000'000;  // a field that is late, and what is said meanwhile
      bench.seeNothingValid();
    }
    std::printf(
        "  a press held for 200 fields, %.0f in a second, one in ten late by 0.3 s: its last id is %d; right: 1\n",
        1e9 / static_cast<double>(interval_ns), static_cast<int>(id));
    EXPECT_EQ(id, 1U);
    EXPECT_EQ(phases(bench.see({})), (Reported{{1, ContactPhase::kAbsent}})) << "one field may overlook it";
    bench.field.time_ns += std::max<std::int64_t>(100'000'000, 4 * interval_ns);
    EXPECT_EQ(causes(bench.see({})), (Causes{{1, EndCause::kLifted}}));
  }
}

TEST(Tracker, AnEndSaysWhetherNothingIsThere) {
  Bench bench;
  bench.see({at(-4, 0, 2.0), at(4, 0, 1.0), at(30, 0)}, 10);
  bench.see({at(-4.0 / 3, 0, 3.0)}, 5);
  EXPECT_EQ(causes(bench.see({at(-4.0 / 3, 0, 3.0)})), (Causes{{2, EndCause::kMerged}, {3, EndCause::kLifted}}));
  bench.field.basis.zero[0] = 1;
  EXPECT_EQ(causes(bench.see({at(-1, 0, 3.0)})), (Causes{{1, EndCause::kZero}}));
  bench.field.basis.boot[0] = 1;
  EXPECT_EQ(causes(bench.see({at(-1, 0, 3.0)})), (Causes{{4, EndCause::kStopped}}));
  bench.field.time_ns -= 1'000'000'000;
  EXPECT_EQ(causes(bench.see({at(-1, 0, 3.0)})), (Causes{{5, EndCause::kStopped}}));
  EXPECT_EQ(causes(bench.tracker.endAll()), (Causes{{6, EndCause::kStopped}}));
}

TEST(Tracker, ALiftedContactIsNotFollowedThroughFieldsThatAreNotValid) {
  Bench bench;
  for (int frame = 0; frame < 10; ++frame) bench.see({at(3 * frame, 0)});
  bench.see({});
  bench.seeNothingValid(2);
  EXPECT_EQ(phases(bench.see({at(39, 0)})), (Reported{{1, ContactPhase::kAbsent}, {2, ContactPhase::kBegin}}));
}

TEST(Tracker, DoubtIsThatOfTheFieldInWhichAContactWasSeen) {
  Bench bench;
  bench.field.doubted = true;
  EXPECT_TRUE(bench.see({at(0, 0)}).front().doubted);
  bench.field.doubted = false;
  EXPECT_TRUE(bench.seeNothingValid().front().doubted);
  EXPECT_FALSE(bench.see({at(0, 0)}).front().doubted);
}

TEST(Tracker, VelocityIsUnknownAtFirstThenThatOfTheMotion) {
  Bench bench;
  const Contact first = bench.see({at(0, 0)}).front();
  EXPECT_EQ(first.velocity_m_s, (std::array<double, 2>{}));
  EXPECT_EQ(first.velocityDeviation_m_s, (std::array<double, 2>{0.25, 0.25}));
  Contact last;
  for (int frame = 1; frame < 30; ++frame) last = bench.see({at(frame, -0.5 * frame)}).front();
  EXPECT_NEAR(last.velocity_m_s[0], 0.06, 1e-3);
  EXPECT_NEAR(last.velocity_m_s[1], -0.03, 1e-3);
  EXPECT_LT(last.velocityDeviation_m_s[0], 0.02);
}

TEST(Tracker, AShearedContactSlipsWhenItMovesAlongItsShear) {
  const auto sheared = [](double x_mm) {
    Observation one = at(x_mm, 0.0, 4.0);
    one.force_N[0] = 1.9;
    one.shearSpreadRatio = 1.03;
    one.shearSpreadRatioDeviation = 0.03;
    return one;
  };
  Bench bench;
  EXPECT_EQ(bench.see({sheared(0.0)}, 30).front().slip.value().state, SlipState::kIncipient);
  for (int frame = 1; frame < 30; ++frame) bench.see({sheared(frame / 15.0)});  // 4 mm/s
  EXPECT_EQ(bench.see({sheared(2.0)}).front().slip.value().state, SlipState::kSlipping);
  EXPECT_FALSE(bench.see({}).front().slip);
  EXPECT_EQ(bench.see({at(2.0, 0.0)}).front().slip.value().state, SlipState::kUnknown);
}

TEST(Tracker, AContactOfAnyShapeSlidesAlongACurve) {
  // As a body does that is pulled and turned: at 10 mm/s about a point 3 mm beside it.
  Bench bench;
  std::optional<Slip> slip;
  for (int frame = 0; frame < 60; ++frame) {
    const double angle = std::fmax(0.0, frame - 30) * 10.0 / 3.0 / 60.0;
    Observation one = at(3.0 * std::sin(angle), -3.0 * std::cos(angle), 4.0);
    one.force_N[0] = 1.2 * std::cos(angle);
    one.force_N[1] = 1.2 * std::sin(angle);
    one.moment_Nm[2] = 2e-3;
    one.halfAxes_m = {3.6e-3, 3.6e-3};
    one.orientationDeviation_rad = 0.9;
    slip = bench.see({one}).front().slip;
    if (frame <= 30) {
      EXPECT_EQ(slip.value().model, SlipModel::kBound) << frame;
    }
  }
  EXPECT_EQ(slip.value().state, SlipState::kSlipping);
  EXPECT_EQ(slip.value().model, SlipModel::kSliding);
  EXPECT_NEAR(slip.value().friction.estimate, std::hypot(1.2, 2e-3 / 2.7e-3) / 4.0, 0.01);
}

TEST(Tracker, WhatShearsAContactThatSticksIsNoSlide) {
  Bench bench;
  for (int frame = 0; frame < 60; ++frame) {
    const double shear_N = std::min(2.0, 0.3 * frame);
    Observation one =
        at(0.17 * shear_N, 0.0, 4.0);  // 0.34 mm in 0.1 s: 0.1 radii for each unit of shear over normal force
    one.area_m2 = 1.5e-4;
    one.force_N[0] = shear_N;
    const std::optional<Slip> slip = bench.see({one}).front().slip;
    if (slip) {
      EXPECT_EQ(slip->model, SlipModel::kBound) << frame;
    }
  }
}

}  // namespace
}  // namespace touch

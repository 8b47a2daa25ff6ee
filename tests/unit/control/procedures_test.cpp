// Zeros that are requested or restored, and a step of a calibration. What disks, frames and people do meanwhile:
// tests/simulation.
#include "daemon/control/procedures.h"
#include "tests/unit/control/procedures_bench.h"

#include <gtest/gtest.h>

namespace tractiond::control::procedures_test {
namespace {

TEST(Procedures, AFinishedZeroIsComparedDescribedKeptAndAnswered) {
  ProceduresBench bench;
  bench.doubt = "it looks pressed";
  bench.procedures.zero().begin({});
  EXPECT_EQ(bench.tracker.state, track::ZeroState::kRequested);
  bench.tracker.finish(bench.pose(1, true));
  bench.turn();
  EXPECT_EQ(bench.comparisons, 1);
  ASSERT_TRUE(bench.described);
  EXPECT_EQ(bench.described->id[0], 1);
  ASSERT_TRUE(bench.kept);
  EXPECT_EQ(bench.kept->id[0], 1);
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  ASSERT_TRUE(bench.zeroAnswers[0]);
  EXPECT_EQ(bench.zeroAnswers[0]->id[0], 1);
  EXPECT_EQ(bench.remark, "the gel file does not fit the picture, and no forces are valid: it looks pressed");
}

TEST(Procedures, ARestoredZeroIsComparedAndDescribedAndNotKeptAgain) {
  ProceduresBench bench;
  bench.procedures.restore("Camera-1", 0.0, bench.pose(7, true));
  EXPECT_EQ(bench.comparisons, 1);
  ASSERT_TRUE(bench.described);
  EXPECT_EQ(bench.described->id[0], 7);
  EXPECT_FALSE(bench.kept);
}

/// Neighbours agree.
RestPose pressed(const ProceduresBench& bench, std::uint8_t id, float peak_px) {
  RestPose pose = bench.pose(id, true);
  for (int i = 0; i < 4; ++i) {
    for (int k = 0; k < 4; ++k) pose.position_px[2 * (24 * (10 + i) + 10 + k)] += peak_px;
  }
  return pose;
}

TEST(Procedures, AZeroWhileTheGelRecoversIsRefusedUnlessItIsWantedAnyway) {
  ProceduresBench bench;
  bench.procedures.restore("Camera-1", 0.0, bench.pose(1, true));
  const auto zero = [&](float remembered_px, bool anyway) {
    MarkerField field;
    field.resize(bench.sensor.markerCount());
    std::ranges::fill(field.valid, std::uint8_t{1});
    field.elastic_px.resize(field.displacement_px.size());
    field.creepErrors_px.resize(field.displacement_px.size());
    field.displacement_px[700] = remembered_px;
    bench.markers.put(field);
    bench.turn();
    bench.procedures.zero().begin({.anyway = anyway, .asker = "10.0.0.7"});
    bench.tracker.finish(bench.pose(2, true));
    bench.turn();
    return bench.zeroAnswers.back();
  };
  ASSERT_FALSE(zero(0.05F, false));
  EXPECT_NE(
      bench.zeroAnswers.back().error().find("recovers from earlier loads, which displace markers by up to 0.05 px"),
      std::string::npos);
  EXPECT_EQ(bench.tracker.adopted->id[0], 1);
  ASSERT_TRUE(zero(0.05F, true));
  EXPECT_NE(bench.remark.find("recovers from earlier loads"), std::string::npos);
  ASSERT_TRUE(zero(0.01F, false));
  EXPECT_EQ(bench.remark, "");
}

TEST(Procedures, AZeroInWhichSomethingTouchesIsRefusedUnlessItIsWantedAnyway) {
  ProceduresBench bench;
  bench.procedures.restore("Camera-1", 0.0, bench.pose(1, true));
  bench.procedures.zero().begin({.asker = "10.0.0.7"});
  bench.tracker.finish(pressed(bench, 2, 0.3F));
  bench.turn();
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  ASSERT_FALSE(bench.zeroAnswers[0]);
  EXPECT_NE(bench.zeroAnswers[0].error().find("something seems to touch the gel near"), std::string::npos);
  EXPECT_FALSE(bench.kept);
  EXPECT_EQ(bench.described->id[0], 1);
  ASSERT_TRUE(bench.tracker.adopted);
  EXPECT_EQ(bench.tracker.adopted->id[0], 1);

  bench.procedures.zero().begin({.anyway = true, .asker = "10.0.0.7"});
  bench.tracker.finish(pressed(bench, 3, 0.3F));
  bench.turn();
  ASSERT_EQ(bench.zeroAnswers.size(), 2U);
  ASSERT_TRUE(bench.zeroAnswers[1]);
  EXPECT_NE(bench.remark.find("something seems to touch"), std::string::npos);
  EXPECT_EQ(bench.kept->id[0], 3);
  EXPECT_EQ(bench.keptBefore->id[0], 1);
  EXPECT_EQ(bench.described->requestedBy, "10.0.0.7");
}

TEST(Procedures, WhatHeatDoesIsNoTouch) {
  ProceduresBench bench;
  bench.procedures.restore("Camera-1", 0.0, bench.pose(1, true));
  bench.procedures.zero().begin({});
  bench.tracker.finish(pressed(bench, 2, 0.015F));
  bench.turn();
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  EXPECT_TRUE(bench.zeroAnswers[0]);
}

TEST(Procedures, AZeroThatHasJustBeenTakenIsTheAnswerAlsoWhenItIsTooLate) {
  ProceduresBench bench;
  bench.procedures.zero().begin({});
  bench.turn();
  bench.pass(4900);
  bench.turn();
  bench.tracker.state = track::ZeroState::kTaken;  // its pose is on the way
  bench.pass(1100);
  bench.turn();
  EXPECT_TRUE(bench.zeroAnswers.empty());
  bench.tracker.finish(bench.pose(1, true));
  bench.turn();
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  EXPECT_TRUE(bench.zeroAnswers[0]);
}

TEST(Procedures, ATrackersRefusalIsTheAnswer) {
  for (const auto state : {track::ZeroState::kMoving, track::ZeroState::kTooFew, track::ZeroState::kTorn}) {
    ProceduresBench bench;
    bench.procedures.zero().begin({});
    bench.tracker.state = state;
    bench.turn();
    bench.turn();
    ASSERT_EQ(bench.zeroAnswers.size(), 1U);
    EXPECT_EQ(bench.zeroAnswers[0].error(), track::describe(state));
  }
}

TEST(Procedures, WhileAStepWorksTheControlLoopGoesOn) {
  ProceduresBench bench;
  bench.procedures.restore("Camera-1", 0.0, bench.pose(1, true));
  bench.workTakesLong = true;
  CalibrationStep stiffness;
  stiffness.kind = CalibrationStep::Kind::kStiffness;
  bench.procedures.beginStep(stiffness);
  bench.turn();
  EXPECT_TRUE(bench.stepAnswers.empty());
  EXPECT_FALSE(bench.procedures.hurried()) << "it looks at no frames";
  bench.procedures.zero().begin({});
  bench.tracker.finish(bench.pose(2, true));
  bench.turn();
  EXPECT_EQ(bench.zeroAnswers.size(), 1U);
  bench.doWork();
  bench.turn();
  ASSERT_EQ(bench.stepAnswers.size(), 1U);
  EXPECT_EQ(bench.stepAnswers[0].error(), "no weight has been read") << "the new zero does not matter to it";
}

}  // namespace
}  // namespace tractiond::control::procedures_test

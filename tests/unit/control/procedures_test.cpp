// Zeros that are requested or restored: judged, kept on the disk, refused, undone.
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
  bench.procedures.welcome("Camera-1", 0.0, bench.pose(7, true));
  EXPECT_EQ(bench.comparisons, 1);
  ASSERT_TRUE(bench.described);
  EXPECT_EQ(bench.described->id[0], 7);
  EXPECT_FALSE(bench.kept);
}

TEST(Procedures, AZeroComesIntoForceWhenItIsOnTheDisk) {
  ProceduresBench bench;
  bench.procedures.welcome("Camera-1", 0.0, bench.pose(1, true));
  bench.diskHangs = true;
  bench.procedures.zero().begin({});
  bench.tracker.finish(bench.pose(2, true));
  for (int i = 0; i < 400; ++i) {  // frames come and go meanwhile
    bench.pass(100);
    bench.turn();
  }
  EXPECT_TRUE(bench.zeroAnswers.empty());
  EXPECT_FALSE(bench.tracker.adopted);
  EXPECT_EQ(bench.described->id[0], 1);
  bench.writeOne();
  bench.turn();
  ASSERT_TRUE(bench.tracker.adopted);
  EXPECT_EQ(bench.tracker.adopted->id[0], 2);
  EXPECT_EQ(bench.reportedZero[0], 2);
  EXPECT_EQ(bench.described->id[0], 2);
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  EXPECT_TRUE(bench.zeroAnswers[0]);
}

TEST(Procedures, AZeroThatTheDiskDoesNotTakeIsRefusedAndReplacedThere) {
  ProceduresBench bench;
  bench.takeThirdZeroWhileTheDiskHangs();
  bench.pass(ZeroProcedure::kKeptWithin_ns / 1'000'000 + 1);
  bench.turn();
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  ASSERT_FALSE(bench.zeroAnswers[0]);
  EXPECT_NE(bench.zeroAnswers[0].error().find("was not written"), std::string::npos) << bench.zeroAnswers[0].error();
  EXPECT_EQ(bench.tracker.adopted->id[0], 2);
  bench.procedures.zero().begin({});
  ASSERT_EQ(bench.zeroAnswers.size(), 2U) << "asked for while the disk hangs";
  EXPECT_FALSE(bench.zeroAnswers[1]);
  EXPECT_FALSE(bench.tracker.asked());

  bench.writeOne();  // at last, and what a restart would find is not what is in force
  bench.turn();
  ASSERT_EQ(bench.disk.size(), 1U);
  EXPECT_EQ(bench.kept->id[0], 2);
  EXPECT_EQ(bench.keptBefore->id[0], 1);
  bench.writeOne();
  bench.turn();
  EXPECT_EQ(bench.described->id[0], 2);
  EXPECT_EQ(bench.zeroAnswers.size(), 2U);

  bench.diskHangs = false;
  bench.procedures.zero().begin({});
  bench.tracker.finish(bench.pose(4, true));
  bench.turn();
  EXPECT_EQ(bench.tracker.adopted->id[0], 4);
}

TEST(Procedures, AZeroThatCannotBeKeptIsRefused) {
  ProceduresBench bench;
  bench.procedures.welcome("Camera-1", 0.0, bench.pose(1, true));
  bench.keepFails = bench.tracker.busy = true;
  bench.procedures.zero().begin({});
  bench.tracker.finish(bench.pose(2, true));
  bench.turn();
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  ASSERT_FALSE(bench.zeroAnswers[0]);
  EXPECT_NE(bench.zeroAnswers[0].error().find("could not be written: the disk is full"), std::string::npos);
  EXPECT_EQ(bench.described->id[0], 1);
  EXPECT_FALSE(bench.tracker.adopted);
  bench.tracker.busy = false;
  bench.turn();
  ASSERT_TRUE(bench.tracker.adopted);
  EXPECT_EQ(bench.tracker.adopted->id[0], 1);
  EXPECT_EQ(bench.reportedZero[0], 1);
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
  bench.procedures.welcome("Camera-1", 0.0, bench.pose(1, true));
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
  bench.procedures.welcome("Camera-1", 0.0, bench.pose(1, true));
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
  bench.procedures.welcome("Camera-1", 0.0, bench.pose(1, true));
  bench.procedures.zero().begin({});
  bench.tracker.finish(pressed(bench, 2, 0.015F));
  bench.turn();
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  EXPECT_TRUE(bench.zeroAnswers[0]);
}

TEST(Procedures, AZeroIsUndoneAndThatAsWell) {
  ProceduresBench bench;
  bench.procedures.welcome("Camera-1", 0.0, bench.pose(1, true));
  bench.procedures.zero().begin({.undo = true});
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  EXPECT_FALSE(bench.zeroAnswers[0]) << "there is none before";

  bench.procedures.zero().begin({.anyway = true});
  bench.tracker.finish(bench.pose(2, true));
  bench.turn();
  for (const int id : {1, 2, 1}) {
    bench.procedures.zero().begin({.undo = true});
    ASSERT_TRUE(bench.zeroAnswers.back());
    EXPECT_EQ(bench.zeroAnswers.back()->id[0], id);
    EXPECT_EQ(bench.described->id[0], id);
    EXPECT_EQ(bench.tracker.adopted->id[0], id);
    EXPECT_EQ(bench.kept->id[0], id);
    EXPECT_EQ(bench.keptBefore->id[0], 3 - id);
  }
  EXPECT_EQ(bench.zeroAnswers.size(), 5U);

  bench.keepFails = true;
  bench.procedures.zero().begin({.undo = true});
  EXPECT_FALSE(bench.zeroAnswers.back());
  EXPECT_EQ(bench.described->id[0], 1);
}

TEST(Procedures, AZeroIsUndoneAlsoAfterARestart) {
  ProceduresBench bench;
  bench.procedures.welcome("Camera-1", 0.0, bench.pose(2, true), bench.pose(1, true));
  bench.procedures.zero().begin({.undo = true});
  ASSERT_TRUE(bench.zeroAnswers.back());
  EXPECT_EQ(bench.tracker.adopted->id[0], 1);
}

}  // namespace
}  // namespace tractiond::control::procedures_test

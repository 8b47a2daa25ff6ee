#include "daemon/procedures.h"
#include "tests/unit/pipeline/procedures_bench.h"

#include <gtest/gtest.h>

namespace tractiond::procedures_test {
namespace {

TEST(Procedures, AFinishedZeroIsComparedDescribedKeptAndAnswered) {
  ProceduresBench bench;
  bench.doubt = "it looks pressed";
  bench.procedures.beginZero({});
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

TEST(Procedures, AZeroOfTheFirstStartAnswersNobody) {
  ProceduresBench bench;
  bench.procedures.beginZero({});
  bench.tracker.finish(bench.pose(1, false));
  bench.turn();
  EXPECT_TRUE(bench.described && bench.kept);
  EXPECT_TRUE(bench.zeroAnswers.empty());
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
  bench.procedures.beginZero({});
  bench.tracker.finish(bench.pose(2, true));
  for (int i = 0; i < 400; ++i) {  // frames come and go meanwhile
    bench.pass(100);
    bench.turn();
  }
  EXPECT_TRUE(bench.zeroAnswers.empty());
  EXPECT_FALSE(bench.adopted);
  EXPECT_EQ(bench.described->id[0], 1);
  bench.writeOne();
  bench.turn();
  ASSERT_TRUE(bench.adopted);
  EXPECT_EQ(bench.adopted->id[0], 2);
  EXPECT_EQ(bench.reportedZero[0], 2);
  EXPECT_EQ(bench.described->id[0], 2);
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  EXPECT_TRUE(bench.zeroAnswers[0]);
}

TEST(Procedures, AZeroIsComparedBeforeTheDiskIsAsked) {
  ProceduresBench bench;
  bench.takeThirdZeroWhileTheDiskHangs();
  EXPECT_EQ(bench.lastCompared[0], 3) << "a load that comes while the disk writes hides markers";
  EXPECT_EQ(bench.reportedZero[0], 2) << "the status tells of the zero in force";
  bench.writeOne();
  bench.turn();
  EXPECT_EQ(bench.comparisons, 2);
  EXPECT_EQ(bench.reportedZero[0], 3);

  bench.procedures.beginZero({.undo = true});
  EXPECT_EQ(bench.lastCompared[0], 2);
  EXPECT_EQ(bench.reportedZero[0], 3);
  bench.writeOne();
  bench.turn();
  EXPECT_EQ(bench.reportedZero[0], 2);
}

TEST(Procedures, AZeroThatIsRefusedLeavesTheReportOnTheOneInForce) {
  ProceduresBench bench;
  bench.procedures.welcome("Camera-1", 0.0, bench.pose(1, true));
  bench.keepFails = true;
  bench.doubt = "it looks pressed";
  bench.procedures.beginZero({});
  bench.tracker.finish(bench.pose(2, true));
  bench.turn();
  ASSERT_TRUE(bench.adopted);
  EXPECT_EQ(bench.adopted->id[0], 1);
  EXPECT_TRUE(bench.adoptedFits);
  EXPECT_EQ(bench.reportedZero[0], 1);
}

TEST(Procedures, AZeroThatTheDiskDoesNotTakeIsRefusedAndReplacedThere) {
  ProceduresBench bench;
  bench.takeThirdZeroWhileTheDiskHangs();
  bench.pass(zero::ZeroProcedure::kKeptWithin_ns / 1'000'000 + 1);
  bench.turn();
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  ASSERT_FALSE(bench.zeroAnswers[0]);
  EXPECT_NE(bench.zeroAnswers[0].error().find("was not written"), std::string::npos) << bench.zeroAnswers[0].error();
  EXPECT_EQ(bench.adopted->id[0], 2);
  bench.procedures.beginZero({});
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
  bench.procedures.beginZero({});
  bench.tracker.finish(bench.pose(4, true));
  bench.turn();
  EXPECT_EQ(bench.adopted->id[0], 4);
}

TEST(Procedures, TheFirstZeroDoesNotWaitForTheDisk) {
  ProceduresBench bench;
  bench.diskHangs = true;
  bench.tracker.finish(bench.pose(1, false));
  bench.turn();
  EXPECT_EQ(bench.comparisons, 1);
  ASSERT_TRUE(bench.described);
  EXPECT_EQ(bench.described->id[0], 1);
}

TEST(Procedures, AZeroThatCannotBeKeptIsRefused) {
  ProceduresBench bench;
  bench.procedures.welcome("Camera-1", 0.0, bench.pose(1, true));
  bench.keepFails = bench.busy = true;
  bench.procedures.beginZero({});
  bench.tracker.finish(bench.pose(2, true));
  bench.turn();
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  ASSERT_FALSE(bench.zeroAnswers[0]);
  EXPECT_NE(bench.zeroAnswers[0].error().find("could not be written: the disk is full"), std::string::npos);
  EXPECT_EQ(bench.described->id[0], 1);
  EXPECT_FALSE(bench.adopted);
  bench.busy = false;
  bench.turn();
  ASSERT_TRUE(bench.adopted);
  EXPECT_EQ(bench.adopted->id[0], 1);
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

TEST(Procedures, AZeroInWhichSomethingTouchesIsRefusedUnlessItIsWantedAnyway) {
  ProceduresBench bench;
  bench.procedures.welcome("Camera-1", 0.0, bench.pose(1, true));
  bench.procedures.beginZero({.asker = "10.0.0.7"});
  bench.tracker.finish(pressed(bench, 2, 0.3F));
  bench.turn();
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  ASSERT_FALSE(bench.zeroAnswers[0]);
  EXPECT_NE(bench.zeroAnswers[0].error().find("something seems to touch the gel near"), std::string::npos);
  EXPECT_FALSE(bench.kept);
  EXPECT_EQ(bench.described->id[0], 1);
  ASSERT_TRUE(bench.adopted);
  EXPECT_EQ(bench.adopted->id[0], 1);

  bench.procedures.beginZero({.anyway = true, .asker = "10.0.0.7"});
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
  bench.procedures.beginZero({});
  bench.tracker.finish(pressed(bench, 2, 0.015F));
  bench.turn();
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  EXPECT_TRUE(bench.zeroAnswers[0]);
}

TEST(Procedures, AZeroIsUndoneAndThatAsWell) {
  ProceduresBench bench;
  bench.procedures.welcome("Camera-1", 0.0, bench.pose(1, true));
  bench.procedures.beginZero({.undo = true});
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  EXPECT_FALSE(bench.zeroAnswers[0]) << "there is none before";

  bench.procedures.beginZero({.anyway = true});
  bench.tracker.finish(bench.pose(2, true));
  bench.turn();
  for (const int id : {1, 2, 1}) {
    bench.procedures.beginZero({.undo = true});
    ASSERT_TRUE(bench.zeroAnswers.back());
    EXPECT_EQ(bench.zeroAnswers.back()->id[0], id);
    EXPECT_EQ(bench.described->id[0], id);
    EXPECT_EQ(bench.adopted->id[0], id);
    EXPECT_EQ(bench.kept->id[0], id);
    EXPECT_EQ(bench.keptBefore->id[0], 3 - id);
  }
  EXPECT_EQ(bench.zeroAnswers.size(), 5U);

  bench.keepFails = true;
  bench.procedures.beginZero({.undo = true});
  EXPECT_FALSE(bench.zeroAnswers.back());
  EXPECT_EQ(bench.described->id[0], 1);
}

TEST(Procedures, AStepDoesNotAnswerAnUndoThatIsBeingWritten) {
  ProceduresBench bench;
  bench.procedures.welcome("Camera-1", 60.0, bench.pose(2, true), bench.pose(1, true));
  bench.diskHangs = true;
  bench.procedures.beginZero({.undo = true});
  bench.procedures.beginStep(ProceduresBench::noise(1.0));
  EXPECT_TRUE(bench.zeroAnswers.empty());
  bench.writeOne();
  bench.turn();
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  ASSERT_TRUE(bench.zeroAnswers[0]) << bench.zeroAnswers[0].error();
  EXPECT_EQ(bench.zeroAnswers[0]->id[0], 1);
  ASSERT_EQ(bench.stepAnswers.size(), 1U) << "it began with the zero before";
  EXPECT_FALSE(bench.stepAnswers[0]);
}

TEST(Procedures, AZeroThatComesIntoForceEndsTheStepThatRuns) {
  ProceduresBench bench;
  bench.procedures.welcome("Camera-1", 60.0, bench.pose(1, true));
  bench.diskHangs = true;
  bench.procedures.beginZero({});
  bench.tracker.finish(bench.pose(2, true));
  bench.turn();
  bench.procedures.beginStep(ProceduresBench::noise(1.0));
  EXPECT_TRUE(bench.stepAnswers.empty());
  bench.writeOne();
  bench.turn();
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  ASSERT_EQ(bench.stepAnswers.size(), 1U) << "it began with the zero before";
  EXPECT_FALSE(bench.stepAnswers[0]);
}

TEST(Procedures, AZeroIsUndoneAlsoAfterARestart) {
  ProceduresBench bench;
  bench.procedures.welcome("Camera-1", 0.0, bench.pose(2, true), bench.pose(1, true));
  bench.procedures.beginZero({.undo = true});
  ASSERT_TRUE(bench.zeroAnswers.back());
  EXPECT_EQ(bench.adopted->id[0], 1);
}

/// At a rate, for a time: turns as the daemon makes them.
void run(ProceduresBench& bench, double seconds, double rate_Hz) {
  const double begin_s = 1e-9 * static_cast<double>(bench.now_ns);
  for (double next_s = begin_s, now_s = begin_s; now_s < begin_s + seconds; now_s += 0.1) {
    for (; rate_Hz > 0.0 && next_s <= now_s; next_s += 1.0 / rate_Hz) bench.frames.add();
    bench.turn();
    bench.pass(100);
  }
}

TEST(Procedures, AZeroThatWasRefusedIsNotAskedForAnyMore) {
  ProceduresBench bench;
  bench.procedures.beginZero({});
  run(bench, 5.3, 0.0);
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  EXPECT_EQ(bench.zeroAnswers[0].error(), "no frames come from the camera");
  EXPECT_FALSE(bench.tracker.asked());  // when frames return, what is then on the gel is a load
  run(bench, 60.0, 60.0);
  EXPECT_EQ(bench.zeroAnswers.size(), 1U);
}

TEST(Procedures, AsLongAsFramesComeAZeroMayTakeItsTime) {
  ProceduresBench bench(10'000);
  bench.procedures.welcome("Camera-1", 30.0, std::nullopt);
  bench.procedures.beginZero({});
  run(bench, 340.0, 30.0);
  EXPECT_TRUE(bench.zeroAnswers.empty());
  EXPECT_TRUE(bench.tracker.asked());
}

TEST(Procedures, AZeroThatHasJustBeenTakenIsTheAnswerAlsoWhenItIsTooLate) {
  ProceduresBench bench;
  bench.procedures.beginZero({});
  run(bench, 5.05, 0.0);
  bench.tracker.state = track::ZeroState::kTaken;  // its pose is on the way
  run(bench, 1.0, 0.0);
  EXPECT_TRUE(bench.zeroAnswers.empty());
  bench.tracker.finish(bench.pose(1, true));
  bench.turn();
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  EXPECT_TRUE(bench.zeroAnswers[0]);
}

TEST(Procedures, ATrackersRefusalIsTheAnswer) {
  for (const auto state : {track::ZeroState::kMoving, track::ZeroState::kTooFew, track::ZeroState::kTorn}) {
    ProceduresBench bench;
    bench.procedures.beginZero({});
    bench.tracker.state = state;
    bench.turn();
    bench.turn();
    ASSERT_EQ(bench.zeroAnswers.size(), 1U);
    EXPECT_EQ(bench.zeroAnswers[0].error(), track::describe(state));
  }
}

TEST(Procedures, AStepThatRestsOnTheZeroTakesOverFromOneThatIsAskedFor) {
  ProceduresBench bench;
  bench.procedures.welcome("Camera-1", 60.0, bench.pose(1, true));
  bench.procedures.beginZero({});
  CalibrationStep finish;
  finish.kind = CalibrationStep::Kind::kFinish;
  bench.procedures.beginStep(finish);
  EXPECT_TRUE(bench.zeroAnswers.empty());
  bench.procedures.beginStep(ProceduresBench::noise(5.0));
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  EXPECT_FALSE(bench.zeroAnswers[0]);
  EXPECT_FALSE(bench.tracker.asked());
  EXPECT_TRUE(bench.procedures.hurried());
}

TEST(Procedures, StepsDoNotLengthenAZerosPatience) {
  ProceduresBench bench;
  bench.procedures.beginZero({});
  for (int i = 0; i < 9; ++i) {
    CalibrationStep step;
    step.kind = CalibrationStep::Kind::kStiffness;
    bench.procedures.beginStep(step);
    run(bench, 0.6, 0.0);
  }
  EXPECT_EQ(bench.zeroAnswers.size(), 1U);
}

TEST(Procedures, SaysHowLongAZeroMayTakeAndKeepsToIt) {
  struct Case {
    int frames;
    double told_Hz, real_Hz;
  };
  constexpr double kKeptWithin_s = 1e-9 * static_cast<double>(zero::ZeroProcedure::kKeptWithin_ns);
  for (const Case& c :
       {Case{30, 60.0, 60.0}, {30, 0.0, 12.5}, {10'000, 30.0, 30.0}, {100, 60.0, 2.0}, {30, 0.0, 0.3}}) {
    SCOPED_TRACE(testing::Message() << c.frames << " frames at " << c.real_Hz << " / s");
    ProceduresBench bench(c.frames);
    bench.procedures.welcome("Camera-1", c.told_Hz, std::nullopt);
    run(bench, 10.0, c.real_Hz);
    const double within_s = bench.zeroWithin_s();
    EXPECT_GE(within_s, kKeptWithin_s + c.frames / c.real_Hz);
    EXPECT_LE(within_s, kKeptWithin_s + 5.1 + 1.2 * (2 * c.frames + 2) / c.real_Hz);
    bench.procedures.beginZero({});
    run(bench, within_s - kKeptWithin_s - 0.5, c.real_Hz);
    EXPECT_TRUE(bench.zeroAnswers.empty());
    run(bench, 1.0, c.real_Hz);
    ASSERT_EQ(bench.zeroAnswers.size(), 1U);
    EXPECT_NE(bench.zeroAnswers[0].error().find("too slowly"), std::string::npos) << bench.zeroAnswers[0].error();
    EXPECT_FALSE(bench.tracker.asked());
  }
}

/// Who asks for a zero while one is being taken is answered with it.
TEST(Procedures, SaysHowLongAnOpenZeroMayTakeWhenTheRateRisesMeanwhile) {
  ProceduresBench bench(100);
  bench.procedures.welcome("Camera-1", 2.0, std::nullopt);
  bench.procedures.beginZero({});
  bench.turn();
  const double within_s = bench.zeroWithin_s();
  EXPECT_GT(within_s, 150.0);
  run(bench, 10.0, 60.0);
  EXPECT_NEAR(bench.zeroWithin_s(), within_s - 10.0, 1.0);
}

TEST(Procedures, AStepEndsAlsoWhileMarkersAreFew) {
  for (const auto kind : {CalibrationStep::Kind::kNoise, CalibrationStep::Kind::kWeight}) {
    ProceduresBench bench;
    bench.procedures.welcome("Camera-1", 60.0, bench.pose(1, true));
    CalibrationStep step;
    step.kind = kind;
    step.weight_N = 1.0;
    step.seconds = 3.0;
    bench.procedures.beginStep(step);
    for (int i = 0; i < 200 && bench.stepAnswers.empty(); ++i) {
      bench.field(true);
      bench.turn();
      bench.pass(100);
    }
    ASSERT_EQ(bench.stepAnswers.size(), 1U);
    EXPECT_TRUE(bench.stepAnswers[0].error().starts_with("too few markers")) << bench.stepAnswers[0].error();
  }
}

TEST(Procedures, AStepWhoseFramesComeTooSlowlyEnds) {
  ProceduresBench bench;
  bench.procedures.welcome("Camera-1", 60.0, bench.pose(1, true));
  bench.procedures.beginStep(ProceduresBench::noise(1.0));
  for (int i = 0; i < 10 && bench.stepAnswers.empty(); ++i) {
    bench.field();
    bench.turn();
    bench.pass(4000);
  }
  ASSERT_EQ(bench.stepAnswers.size(), 1U);
  EXPECT_TRUE(bench.stepAnswers[0].error().starts_with("frames come too slowly")) << bench.stepAnswers[0].error();
}

TEST(Procedures, ANewZeroEndsTheStepThatRuns) {
  ProceduresBench bench;
  bench.procedures.welcome("Camera-1", 0.0, bench.pose(1, true));
  bench.procedures.beginStep(ProceduresBench::noise(5.0));
  EXPECT_TRUE(bench.procedures.hurried());
  bench.procedures.beginZero({});
  bench.tracker.finish(bench.pose(2, true));
  bench.turn();
  ASSERT_EQ(bench.stepAnswers.size(), 1U);
  EXPECT_EQ(bench.stepAnswers[0].error(), "a new zero was taken meanwhile");
  EXPECT_FALSE(bench.procedures.hurried());
  EXPECT_EQ(bench.zeroAnswers.size(), 1U);
}

TEST(Procedures, AZeroThatWasRefusedIsOverwrittenAsSoonAsTheDiskTakesIt) {
  ProceduresBench bench;
  bench.procedures.welcome("Camera-1", 0.0, bench.pose(2, true), bench.pose(1, true));
  bench.keepFails = true;
  bench.procedures.beginZero({});
  bench.tracker.finish(bench.pose(3, true));
  bench.turn();
  ASSERT_FALSE(bench.zeroAnswers[0]);
  bench.turn();
  EXPECT_EQ(bench.kept->id[0], 2) << "what was refused may be on the disk, if its directory could not be synchronised";
  EXPECT_EQ(bench.keptBefore->id[0], 1);
  bench.keepFails = false;
  bench.kept.reset();
  bench.turn();
  EXPECT_FALSE(bench.kept) << "the disk has just failed";
  bench.pass(10'000);
  bench.turn();
  ASSERT_TRUE(bench.kept);
  EXPECT_EQ(bench.kept->id[0], 2);
  bench.kept.reset();
  bench.pass(60'000);
  bench.turn();
  EXPECT_FALSE(bench.kept) << "it is on the disk";
  EXPECT_EQ(bench.zeroAnswers.size(), 1U);
}

TEST(Procedures, ARestoredZeroThatCouldNotBeSynchronisedIsWrittenUntilTheDiskTakesIt) {
  ProceduresBench bench;
  bench.keepFails = true;
  bench.procedures.welcome("Camera-1", 0.0, bench.pose(2, true), bench.pose(1, true), false);
  ASSERT_TRUE(bench.kept);
  bench.recoverDisk();
  ASSERT_TRUE(bench.kept);
  EXPECT_EQ(bench.kept->id[0], 2);
  EXPECT_EQ(bench.keptBefore->id[0], 1);
}

TEST(Procedures, AFirstZeroThatCouldNotBeWrittenIsWrittenLater) {
  ProceduresBench bench;
  bench.keepFails = true;
  bench.tracker.finish(bench.pose(1, false));
  bench.turn();
  bench.recoverDisk();
  ASSERT_TRUE(bench.kept);
  EXPECT_EQ(bench.kept->id[0], 1);
}

CalibrationStep stiffness() {
  CalibrationStep step;
  step.kind = CalibrationStep::Kind::kStiffness;
  return step;
}

TEST(Procedures, WhileAStepWorksTheControlLoopGoesOn) {
  ProceduresBench bench;
  bench.procedures.welcome("Camera-1", 0.0, bench.pose(1, true));
  bench.workTakesLong = true;
  bench.procedures.beginStep(stiffness());
  bench.turn();
  EXPECT_TRUE(bench.stepAnswers.empty());
  EXPECT_FALSE(bench.procedures.hurried()) << "it looks at no frames";
  bench.procedures.beginZero({});
  bench.tracker.finish(bench.pose(2, true));
  bench.turn();
  EXPECT_EQ(bench.zeroAnswers.size(), 1U);
  bench.doWork();
  bench.turn();
  ASSERT_EQ(bench.stepAnswers.size(), 1U);
  EXPECT_EQ(bench.stepAnswers[0].error(), "no weight has been read") << "the new zero does not matter to it";
}

TEST(Procedures, ANewZeroEndsAStepThatHasYetToLookAtFrames) {
  ProceduresBench bench;
  bench.procedures.welcome("Camera-1", 0.0, bench.pose(1, true));
  bench.workTakesLong = true;
  bench.procedures.beginStep(ProceduresBench::noise(5.0));
  bench.procedures.beginZero({});
  bench.tracker.finish(bench.pose(2, true));
  bench.turn();
  EXPECT_TRUE(bench.stepAnswers.empty());
  bench.doWork();
  bench.turn();
  ASSERT_EQ(bench.stepAnswers.size(), 1U);
  EXPECT_EQ(bench.stepAnswers[0].error(), "a new zero was taken meanwhile");
  EXPECT_FALSE(bench.procedures.hurried());
}

TEST(Procedures, AStepWaitsForTheWorkOfTheOneThatItReplaces) {
  ProceduresBench bench;
  bench.procedures.welcome("Camera-1", 0.0, bench.pose(1, true));
  bench.workTakesLong = true;
  bench.procedures.beginStep(stiffness());
  bench.procedures.beginStep(ProceduresBench::noise(5.0));
  EXPECT_EQ(bench.works.size(), 1U);
  bench.doWork();
  bench.turn();
  EXPECT_TRUE(bench.stepAnswers.empty()) << "the control server has answered the first";
  ASSERT_EQ(bench.works.size(), 1U);
  bench.doWork();
  bench.turn();
  EXPECT_TRUE(bench.procedures.hurried());
  EXPECT_TRUE(bench.stepAnswers.empty());
}

TEST(Procedures, AStepWhoseWorkHangsIsAnswered) {
  for (const bool isReplaced : {false, true}) {
    ProceduresBench bench;
    bench.procedures.welcome("Camera-1", 0.0, bench.pose(1, true));
    bench.workTakesLong = true;
    bench.procedures.beginStep(stiffness());
    if (isReplaced) bench.procedures.beginStep(stiffness());
    bench.pass(241'000);
    bench.turn();
    ASSERT_EQ(bench.stepAnswers.size(), 1U);
    EXPECT_EQ(bench.stepAnswers[0].error(), "a step of a calibration has not ended within four minutes");
    bench.turn();
    bench.doWork();
    bench.turn();
    EXPECT_EQ(bench.stepAnswers.size(), 1U);
    EXPECT_TRUE(bench.works.empty());
    bench.procedures.beginStep(stiffness());
    bench.doWork();
    bench.turn();
    EXPECT_EQ(bench.stepAnswers.size(), 2U) << "the next one begins";
  }
}

}  // namespace
}  // namespace tractiond::procedures_test

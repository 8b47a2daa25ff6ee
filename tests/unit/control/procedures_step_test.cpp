// Steps of a calibration: what ends them, and the zeros that are taken meanwhile.
#include "tests/unit/control/procedures_bench.h"

#include <gtest/gtest.h>

namespace tractiond::control::procedures_test {
namespace {

TEST(Procedures, AStepDoesNotAnswerAnUndoThatIsBeingWritten) {
  ProceduresBench bench;
  bench.procedures.welcome("Camera-1", 60.0, bench.pose(2, true), bench.pose(1, true));
  bench.diskHangs = true;
  bench.procedures.zero().begin({.undo = true});
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

TEST(Procedures, AStepThatRestsOnTheZeroTakesOverFromOneThatIsAskedFor) {
  ProceduresBench bench;
  bench.procedures.welcome("Camera-1", 60.0, bench.pose(1, true));
  bench.procedures.zero().begin({});
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
  bench.procedures.zero().begin({});
  bench.tracker.finish(bench.pose(2, true));
  bench.turn();
  ASSERT_EQ(bench.stepAnswers.size(), 1U);
  EXPECT_EQ(bench.stepAnswers[0].error(), "a new zero was taken meanwhile");
  EXPECT_FALSE(bench.procedures.hurried());
  EXPECT_EQ(bench.zeroAnswers.size(), 1U);
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
  bench.procedures.zero().begin({});
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
  bench.procedures.zero().begin({});
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
}  // namespace tractiond::control::procedures_test

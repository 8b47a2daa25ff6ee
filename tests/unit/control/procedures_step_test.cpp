// Steps of a calibration: what ends them, and the zeros that are taken meanwhile.
#include "tests/unit/control/procedures_bench.h"

#include <gtest/gtest.h>

namespace tractiond::control::procedures_test {
namespace {

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

}  // namespace
}  // namespace tractiond::control::procedures_test

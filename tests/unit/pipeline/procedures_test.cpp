#include "daemon/procedures.h"
#include "tests/unit/pipeline/procedures_bench.h"

#include <gtest/gtest.h>

namespace tractiond {
namespace {

TEST(Procedures, AFinishedZeroIsJudgedDescribedKeptAndAnswered) {
  ProceduresBench bench;
  bench.doubt = "it looks pressed";
  bench.procedures.beginZero();
  EXPECT_EQ(bench.tracker.state, track::ZeroState::kRequested);
  bench.tracker.finish(bench.pose(1, true));
  bench.turn();
  EXPECT_EQ(bench.judged, 1);
  ASSERT_TRUE(bench.described);
  EXPECT_EQ(bench.described->id[0], 1);
  ASSERT_TRUE(bench.kept);
  EXPECT_EQ(bench.kept->id[0], 1);
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  ASSERT_TRUE(bench.zeroAnswers[0]);
  EXPECT_EQ(bench.zeroAnswers[0]->id[0], 1);
  EXPECT_EQ(bench.remark, "it looks pressed");
}

TEST(Procedures, AZeroOfTheFirstStartAnswersNobody) {
  ProceduresBench bench;
  bench.procedures.beginZero();
  bench.tracker.finish(bench.pose(1, false));
  bench.turn();
  EXPECT_TRUE(bench.described && bench.kept);
  EXPECT_TRUE(bench.zeroAnswers.empty());
}

TEST(Procedures, ARestoredZeroIsJudgedAndDescribedAndNotKeptAgain) {
  ProceduresBench bench;
  bench.procedures.welcome("Camera-1", bench.pose(7, true));
  EXPECT_EQ(bench.judged, 1);
  ASSERT_TRUE(bench.described);
  EXPECT_EQ(bench.described->id[0], 7);
  EXPECT_FALSE(bench.kept);
}

TEST(Procedures, WhoAsksForAZeroIsToldThatItCannotBeKept) {
  ProceduresBench bench;
  bench.keepFails = true;
  bench.procedures.beginZero();
  bench.tracker.finish(bench.pose(1, true));
  bench.turn();
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  ASSERT_FALSE(bench.zeroAnswers[0]);
  EXPECT_NE(bench.zeroAnswers[0].error().find("in force but not kept"), std::string::npos);
}

TEST(Procedures, WithoutFramesAZeroIsRefused) {
  ProceduresBench bench;
  bench.procedures.beginZero();
  for (int i = 0; i < 100; ++i) {  // as long as frames come, it may take its time
    bench.pass(100);
    bench.frames.add();
    bench.turn();
  }
  EXPECT_TRUE(bench.zeroAnswers.empty());
  for (int i = 0; i < 52; ++i) {
    bench.pass(100);
    bench.turn();
  }
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  EXPECT_EQ(bench.zeroAnswers[0].error(), "no frames come from the camera");
}

TEST(Procedures, ANewZeroEndsTheStepThatRuns) {
  ProceduresBench bench;
  bench.procedures.welcome("Camera-1", bench.pose(1, true));
  bench.procedures.beginStep(ProceduresBench::noise(5.0));
  EXPECT_TRUE(bench.procedures.hurried());
  bench.procedures.beginZero();
  bench.tracker.finish(bench.pose(2, true));
  bench.turn();
  ASSERT_EQ(bench.stepAnswers.size(), 1U);
  EXPECT_EQ(bench.stepAnswers[0].error(), "a new zero was taken meanwhile");
  EXPECT_FALSE(bench.procedures.hurried());
  EXPECT_EQ(bench.zeroAnswers.size(), 1U);
}

}  // namespace
}  // namespace tractiond

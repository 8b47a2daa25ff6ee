#include "tests/unit/track/scene.h"

#include <gtest/gtest.h>

namespace tractiond::track {
namespace {

TEST(Tracker, FirstStartTakesAZeroByItself) {
  Scene scene;
  Tracking tracking(scene);
  EXPECT_EQ(tracking(scene.shoot()), Outcome::kNoRestPose);
  ASSERT_TRUE(tracking.start(scene));
  EXPECT_EQ(tracking.tracker.zeroState(), ZeroState::kTaken);
  EXPECT_EQ(tracking.field.validCount, scene.markers());
  EXPECT_EQ(tracking.field.flags, kZeroUnverified);
}

}  // namespace
}  // namespace tractiond::track

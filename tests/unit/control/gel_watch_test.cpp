#include "daemon/control/gel_watch.h"
#include "tests/unit/track/scene.h"

#include <gmock/gmock.h>
#include <google/protobuf/arena.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>

namespace tractiond::control {
namespace {

using track::Scene;
using track::Tracking;

/// A tracker, and the watch that compares its zeros with the gel file.
struct Bench {
  Bench()
      : tracking(scene, {.awaitsGelCheck = true})
      , watch(scene.sensor, tracking.tracker, status, nullptr) {}

  void shoot(int frames, bool discontinuity = false) {
    for (int i = 0; i < frames; ++i) {
      tracking(scene.shoot(discontinuity));
      watch.turn();
    }
  }

  /// Shoots until there is a zero.
  /// \return what the watch says of it
  std::string takeZero() {
    RestPose pose;
    for (int i = 0; i < 80; ++i) {
      tracking(scene.shoot());
      if (!tracking.tracker.takeRestPose(pose)) continue;
      report = watch.compare(pose);
      watch.report(pose, report);
      tracking.tracker.putInForce(pose, report.fits());
      return report.remark;
    }
    return "no zero";
  }

  void hideColumns(int count) {
    for (int i = 0; i < scene.markers(); ++i) {
      if (i % 24 < count) scene.now.col(i).setConstant(std::numeric_limits<double>::quiet_NaN());
    }
  }

  bool mismatch() const { return (tracking.field.flags & kGelMismatch) != 0; }

  Scene scene;
  Tracking tracking;
  Mailbox<traction::v1::MarkerStatus> status;
  GelWatch watch;
  GelReport report;  ///< on the zero that was taken last
};

TEST(GelWatch, TellsForWhatTheFirstZeroWaits) {
  Bench bench;
  for (int i = 0; i < 15; ++i) {
    bench.tracking(bench.scene.shoot(false, 0.5 + 0.02 * i));
    bench.watch.turn();
  }
  traction::v1::MarkerStatus status;
  ASSERT_TRUE(bench.status.take(status));
  EXPECT_THAT(status.remark(),
              testing::MatchesRegex(".* waiting: brightness still rises by 3[0-9] % over 10 pictures; .*"));
  bench.takeZero();
  bench.shoot(1);
  ASSERT_TRUE(bench.status.take(status));
  EXPECT_EQ(status.remark(), "");
}

// What hides columns while the picture is labelled anew makes its fields invalid, and no later ones.
TEST(GelWatch, HiddenColumnsDoNotContradictTheGelFile) {
  Bench bench;
  ASSERT_EQ(bench.takeZero(), "");
  bench.hideColumns(5);
  bench.shoot(1, true);
  bench.shoot(3);
  EXPECT_TRUE(bench.report.fits());
  EXPECT_TRUE(bench.mismatch());

  bench.scene.now = bench.scene.rest;
  bench.shoot(3);
  EXPECT_FALSE(bench.mismatch());
  bench.tracking.tracker.requestZero();
  EXPECT_EQ(bench.takeZero(), "");
  EXPECT_TRUE(bench.report.fits());
}

TEST(GelWatch, ColumnsThatAreNotThereContradictTheGelFile) {
  Bench bench;
  bench.hideColumns(2);
  EXPECT_NE(bench.takeZero().find("the picture shows 22 x 24"), std::string::npos);
  EXPECT_FALSE(bench.report.fits());
}

TEST(GelWatch, TellsWhyThereIsNoFirstZero) {
  Bench bench;
  traction::v1::MarkerStatus status;
  const auto remark = [&] {
    bench.status.take(status);
    return status.remark();
  };
  for (int i = 0; i < 200; ++i) {
    track::Bump press;
    press.peak_px = {i < 15 ? 0.0 : 0.3 * (1 + i % 10), 0.0};
    bench.scene.displace(press);
    bench.shoot(1);
    if (i == 100) {
      EXPECT_EQ(remark(), "");
    }
  }
  EXPECT_THAT(remark(),
              testing::MatchesRegex("199 pictures have passed before there was a zero: at most 1[4-6] pictures "
                                    "in a row were still, and 30 are needed: keep the gel untouched and the "
                                    "camera still, or lower track.zero_frames"));
  EXPECT_EQ(bench.takeZero(), "");
  bench.shoot(1);
  EXPECT_EQ(remark(), "");
}

}  // namespace
}  // namespace tractiond::control

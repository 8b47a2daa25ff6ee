// The scenario's time against the clock.
#include "twin/scene_time.h"

#include <gtest/gtest.h>

namespace twin {
namespace {

constexpr double kPeriod_s = 0.02;

// The picture that is drawn when another was sent is the third from that one, as in the twin.
class Sent {
 public:
  Sent() {
    for (int i = 0; i < 3; ++i) drawn_s = time.next(kPeriod_s);
  }

  void at(double clock_s) {
    time.wasSent(clock_s, kPeriod_s);
    drawn_s = time.next(kPeriod_s);
  }

  SceneTime time;
  double drawn_s = 0.0;
};

TEST(SceneTime, IsThePicturesWhereAllAreInTime) {
  Sent sent;
  for (int i = 0; i < 1000; ++i) sent.at(7.0 + kPeriod_s * i + (i % 2 == 0 ? 0.006 : 0.0));
  EXPECT_NEAR(sent.drawn_s, kPeriod_s * 1002, 0.6 * kPeriod_s);
}

TEST(SceneTime, IsTheClocksWherePicturesAreLate) {
  Sent sent;
  for (int i = 0; i < 100; ++i) sent.at(7.0 + 3 * kPeriod_s * i);
  EXPECT_NEAR(sent.drawn_s, 3 * kPeriod_s * 99 + 3 * kPeriod_s, 1e-9);
  sent.at(7.0 + 3 * kPeriod_s * 99 + 0.4);  // the machine stands still
  EXPECT_NEAR(sent.drawn_s, 3 * kPeriod_s * 99 + 0.4 + 3 * kPeriod_s, 1e-9);
}

TEST(SceneTime, StandsStillWhereNobodyWantsPictures) {
  Sent sent;
  for (int i = 0; i < 10; ++i) sent.at(7.0 + kPeriod_s * i);
  const double before_s = sent.drawn_s;
  sent.at(100.0);
  EXPECT_NEAR(sent.drawn_s, before_s + kPeriod_s, 1e-9);
}

}  // namespace
}  // namespace twin

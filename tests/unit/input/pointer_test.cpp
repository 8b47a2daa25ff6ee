// Shear and press in, motion and clicks out.
#include "client/input/pointer.h"
#include "tests/support/seed.h"
#include "tests/unit/input/touches.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace traction::input::test {
namespace {

using Button = PointerStep::Button;

/// A pointer, what it was told, and where it is.
struct Hand {
  Pointer pointer{PointerOptions{}};
  std::int64_t time_ns = 0;
  long right = 0, down = 0;
  std::vector<PointerStep::Change> changes;

  void tell(const Touches& touches) {
    const PointerStep step = pointer.step(touches);
    right += step.right;
    down += step.down;
    changes.insert(changes.end(), step.changes.begin(), step.changes.end());
  }
  void press(double press_N, std::array<double, 2> shear_N = {}) {
    Touch touch = touchOf(1, 0.0, 0.0, press_N);
    touch.shear_N = shear_N;
    tell(fieldOf({touch}, time_ns += kFrame_ns));
  }
  void lift() { tell(fieldOf({}, time_ns += kFrame_ns)); }
  /// Returns how often a button went down; fails if buttons do not go down and up in turn.
  int clicks(Button button) const {
    int downs = 0;
    for (std::size_t i = 0; i < changes.size(); ++i) {
      EXPECT_EQ(changes[i].down, i % 2 == 0);
      if (i % 2 == 1) EXPECT_EQ(changes[i].button, changes[i - 1].button);
      downs += changes[i].down && changes[i].button == button ? 1 : 0;
    }
    EXPECT_EQ(changes.size() % 2, 0U);
    return downs;
  }
};

TEST(Pointer, MovesAtTheSpeedOfTheShearBeyondTheDeadZoneWithinThreePercent) {
  for (const double shear_N : {0.25, 0.5, 1.0, 3.0}) {
    for (const double angle : {0.0, 0.7, 2.0, 4.0}) {
      Hand hand;
      hand.press(0.8);
      for (int frame = 0; frame < 120; ++frame) hand.press(0.8, {shear_N * std::cos(angle), shear_N * std::sin(angle)});
      const double expected = 2.0 * 400.0 * (shear_N - 0.2);
      EXPECT_NEAR(static_cast<double>(hand.right), expected * std::cos(angle), 0.03 * expected + 1.0);
      EXPECT_NEAR(static_cast<double>(hand.down), -expected * std::sin(angle), 0.03 * expected + 1.0);
    }
  }
}

TEST(Pointer, DoesNotDriftUnderAFingerThatRests) {
  std::mt19937 random(tractiond::test::seed());
  std::normal_distribution<double> noise(0.0, 0.02);
  Hand hand;
  for (int frame = 0; frame < 3600; ++frame) hand.press(0.8, {0.08 + noise(random), noise(random) - 0.06});
  EXPECT_EQ(hand.right, 0);
  EXPECT_EQ(hand.down, 0);
  EXPECT_TRUE(hand.changes.empty());
}

TEST(Pointer, MissesAndDoublesNoneOfAThousandClicksOfAHandThatTrembles) {
  std::mt19937 random(tractiond::test::seed());
  std::normal_distribution<double> noise(0.0, 0.02);
  std::uniform_real_distribution<double> peak_N(2.2, 3.4), hold_s(0.05, 0.4), rise_s(0.03, 0.15), phase(0.0, 6.28);
  Hand hand;
  for (int click = 0; click < 1000; ++click) {
    const double peak = peak_N(random), hold = hold_s(random), rise = rise_s(random), start = phase(random);
    for (double t = 0.0; t < 2.0 * rise + hold + 0.1; t += 1e-9 * kFrame_ns) {
      const double shape = t < rise ? t / rise : t < rise + hold ? 1.0 : std::max(0.0, 1.0 - (t - rise - hold) / rise);
      const double tremor = 0.15 * std::sin(2.0 * std::numbers::pi * 10.0 * t + start);  // of a hand: 8 to 12 Hz
      hand.press(0.5 + (peak - 0.5) * shape + tremor + noise(random));
    }
  }
  EXPECT_EQ(hand.clicks(Button::kFirst), 1000);
  EXPECT_EQ(hand.clicks(Button::kSecond), 0);
}

TEST(Pointer, AHarderPressIsTheSecondButtonAlone) {
  Hand hand;
  for (const double press_N : {0.8, 1.8, 3.0, 4.5, 5.0, 2.0, 0.8}) hand.press(press_N);
  EXPECT_EQ(hand.clicks(Button::kSecond), 1);
  EXPECT_EQ(hand.clicks(Button::kFirst), 0);
  for (int frame = 0; frame < 30; ++frame) hand.press(2.0);  // a drag, in which it is pressed harder
  for (const double press_N : {4.5, 2.0, 0.8}) hand.press(press_N);
  EXPECT_EQ(hand.clicks(Button::kFirst), 1);
  EXPECT_EQ(hand.clicks(Button::kSecond), 1);
}

TEST(Pointer, LetsGoWhereTheTouchIsLiftedOrLost) {
  Hand hand;
  for (int frame = 0; frame < 30; ++frame) hand.press(2.0);
  Touch unseen = touchOf(1, 0.0, 0.0, 2.0);
  unseen.seen = false;
  Touches unknown = fieldOf({unseen}, hand.time_ns += kFrame_ns);
  unknown.valid = false;
  hand.tell(unknown);
  ASSERT_EQ(hand.changes.size(), 1U);  // nothing is known: it may still be pressed
  Touches lost{.time_ns = hand.time_ns += kFrame_ns};
  hand.tell(lost);
  EXPECT_EQ(hand.clicks(Button::kFirst), 1);
  for (int frame = 0; frame < 30; ++frame) hand.press(2.0);
  hand.tell(fieldOf({unseen}, hand.time_ns += kFrame_ns));
  EXPECT_EQ(hand.clicks(Button::kFirst), 2);
}

}  // namespace
}  // namespace traction::input::test

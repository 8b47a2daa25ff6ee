// Contacts into the user's frame; wrench and gestures as axes.
#include "client/input/affine.h"
#include "tests/support/seed.h"
#include "tests/unit/input/touches.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <random>

namespace traction::input::test {
namespace {

TEST(View, ShowsTheGelFromTheSideOfItsUser) {
  touch::Contact contact;
  contact.id = 7;
  contact.position_m = {0.01, 0.02};
  contact.force_N = {0.3, 0.4, 2.0};
  contact.moment_Nm = {0.0, 0.0, 5e-3};
  contact.orientation_rad = 0.5;
  Field field;
  field.valid = true;
  field.resultant_N = {0.3, 0.4, 2.0};
  field.moment_Nm = {1e-3, 2e-3, 3e-3};
  View view(0.0);
  const Touches& touches = view.take({contact}, &field, 5);
  ASSERT_EQ(touches.touches.size(), 1U);
  EXPECT_EQ(touches.touches[0].position_m, (std::array{-0.01, 0.02}));
  EXPECT_EQ(touches.touches[0].shear_N, (std::array{-0.3, 0.4}));
  EXPECT_EQ(touches.touches[0].press_N, 2.0);
  EXPECT_EQ(touches.touches[0].torque_Nm, -5e-3);
  EXPECT_NEAR(touches.touches[0].orientation_rad, -0.5, 1e-12);
  EXPECT_EQ(touches.wrench, (Wrench{-0.3, 0.4, -2.0, -1e-3, 2e-3, -3e-3}));

  View turned(std::numbers::pi / 2);
  EXPECT_NEAR(turned.take({contact}, &field, 6).touches[0].position_m[0], -0.02, 1e-12);
  contact.phase = ContactPhase::kUnknown;  // its forces are 0 then, and say nothing
  contact.force_N = {};
  const Touches& unknown = view.take({contact}, nullptr, 6);
  EXPECT_FALSE(unknown.touches[0].seen);
  EXPECT_EQ(unknown.touches[0].press_N, 2.0);
  EXPECT_EQ(unknown.wrench[2], -2.0);
  EXPECT_TRUE(view.take({contact}, nullptr, 200'000'000).touches.empty()) << "it may last, but presses no button";
  contact.phase = ContactPhase::kAbsent;
  EXPECT_TRUE(view.take({contact}, &field, 210'000'000).touches.empty()) << "it was lifted meanwhile";
  contact.phase = ContactPhase::kEnd;
  EXPECT_TRUE(view.take({contact}, nullptr, 7).touches.empty());
  EXPECT_EQ(view.take({}, nullptr, 8).wrench, Wrench{});
}

TEST(Axes, AreProportionalBeyondTheDeadZoneAndEndAtThoseOfAMouse) {
  const auto axes = axesOf({1.2, -1.2, 0.19, 0.0, -0.014, 9.0}, AxesOptions{});
  EXPECT_EQ(axes, (std::array<std::int32_t, 6>{60, -60, 0, 0, -50, 350}));
}

/// A field under two round contacts whose traction is an affine map of places, as a user sees both, with noise.
/// \param growth of x along x, of x along y, of y along x, of y along y [Pa/m]
Field affineField(const Grid& nodes, const std::array<double, 4>& growth, double turn_rad, double noise_N) {
  std::mt19937 random(tractiond::test::seed());
  std::normal_distribution<double> noise(0.0, noise_N);
  const double area_m2 = nodes.pitch_m * nodes.pitch_m;
  Field field;
  field.valid = true;
  for (std::uint32_t i = 0; i < nodes.columns * nodes.rows; ++i) {
    const auto [x, y] = nodes.position_m(i % nodes.columns, i / nodes.columns);
    const bool isPressed = std::hypot(x - 0.008, y - 0.003) < 0.007 || std::hypot(x + 0.012, y + 0.004) < 0.005;
    // Mirrored, and then turned.
    const std::complex<double> place = std::polar(1.0, turn_rad) * std::complex<double>(-x, y);
    const auto along = [&](double ofX, double ofY) { return ofX * place.real() + ofY * place.imag(); };
    const std::complex<double> force =
        area_m2 * std::complex<double>(2'000.0 + along(growth[0], growth[1]), along(growth[2], growth[3]) - 3'000.0);
    const std::complex<double> back = std::polar(1.0, -turn_rad) * force;
    const auto deviation = isPressed ? static_cast<float>(noise_N) : 0.0F;
    field.nodeDeviation_N.push_back({deviation, deviation, deviation});
    field.force_N.push_back({});
    if (isPressed)
      field.force_N.back() = {static_cast<float>(-back.real() + noise(random)),
                              static_cast<float>(back.imag() + noise(random)), 0.1F};
  }
  return field;
}

TEST(Gradient, OfAnAffineFieldIsReadWithinTwoPercentOfTheRange) {
  const Grid nodes{.columns = 24, .rows = 24, .pitch_m = 2e-3, .centre_m = {1e-3, 0.0}};
  constexpr double kRange_Pa_m = 2e6, kNoise_N = 2e-3;
  touch::Contact contact;
  contact.id = 1;
  for (const double turn_rad : {0.0, 0.7}) {
    for (const std::array<double, 4>& growth :
         {std::array{1e6, 0.0, 0.0, 1e6}, std::array{-1e6, 0.0, 0.0, 1e6}, std::array{0.0, 0.5e6, 1.5e6, 0.0},
          std::array{0.0, 1e6, -1e6, 0.0}}) {  // the last one is a twist alone
      View view(turn_rad);
      const Field field = affineField(nodes, growth, turn_rad, kNoise_N);
      const Gradient read = view.take({contact}, &field, 1, &nodes).gradient;
      EXPECT_NEAR(read.dilation_Pa_m, growth[0] + growth[3], 0.02 * kRange_Pa_m);
      EXPECT_NEAR(read.stretch_Pa_m, growth[0] - growth[3], 0.02 * kRange_Pa_m);
      EXPECT_NEAR(read.shear_Pa_m, growth[1] + growth[2], 0.02 * kRange_Pa_m);
      EXPECT_GT(read.deviation_Pa_m, 0.0);
      EXPECT_LT(read.deviation_Pa_m, 0.02 * kRange_Pa_m);
      EXPECT_EQ(view.take({}, &field, 2, &nodes).gradient.dilation_Pa_m, 0.0);
    }
  }
}

TEST(Zoom, TurnsAtTheSpeedOfTheDilationBeyondNoiseAndDeadZone) {
  Zoom zoom({.deadZone_Pa_m = 0.5e6, .gain = 1e-5});
  const auto turned = [&](double dilation_Pa_m, double deviation_Pa_m) {
    int notches = 0;
    for (int frame = 0; frame <= 60; ++frame) {
      Touches field = fieldOf({touchOf(1, 0.0, 0.0)}, (1 + frame) * kFrame_ns);
      field.gradient = {.dilation_Pa_m = dilation_Pa_m, .deviation_Pa_m = deviation_Pa_m};
      notches += zoom.step(field);
    }
    zoom.step(fieldOf({}));
    return notches;
  };
  EXPECT_EQ(turned(1.55e6, 1e4), 10);
  EXPECT_EQ(turned(-1.55e6, 1e4), -10);
  EXPECT_EQ(turned(0.49e6, 1e4), 0);
  EXPECT_EQ(turned(1.55e6, 0.6e6), 0) << "as noise alone may do";
}

TEST(Gesture, OfTwoFingersIsReadWithinTwoPercentOfItsRange) {
  using Place = std::complex<double>;
  std::mt19937 random(tractiond::test::seed());
  std::normal_distribution<double> noise(0.0, 3e-5);
  Gesture gesture;
  constexpr double kTurn = 1.5, kScale = 1.8;
  const Place shift(0.012, -0.008);
  Similarity read;
  std::int64_t time_ns = 0;
  for (int frame = 0; frame <= 120; ++frame) {
    const double part = frame / 120.0;
    const Place factor = std::polar(std::pow(kScale, part), kTurn * part);
    std::vector<Touch> touches;
    for (const Place from : {Place(-0.008, 0.001), Place(0.009, 0.0)}) {
      const Place centre(0.0005, 0.0005), at = centre + factor * (from - centre) + part * shift;
      touches.push_back(touchOf(touches.size() + 1, at.real() + noise(random), at.imag() + noise(random)));
    }
    Touches field = fieldOf(touches, time_ns += kFrame_ns);
    if (frame % 10 == 5) field.touches[1].seen = false;  // as last seen
    read = gesture.follow(field);
    const Similarity same = gesture.follow(fieldOf(field.touches, time_ns));
    EXPECT_EQ(same.turn_rad, read.turn_rad);
  }
  EXPECT_NEAR(read.turn_rad, kTurn, 0.02 * kTurn);
  EXPECT_NEAR(read.scale, kScale, 0.02 * (kScale - 1.0));
  EXPECT_NEAR(read.shift_m[0], shift.real(), 0.02 * 0.012);
  EXPECT_NEAR(read.shift_m[1], shift.imag(), 0.02 * 0.012);
  // One is lifted and put down elsewhere: that is no motion, and then another gesture.
  gesture.follow(fieldOf({touchOf(1, 0.0, 0.0)}));
  EXPECT_EQ(gesture.follow(fieldOf({touchOf(1, 0.01, 0.0), touchOf(3, 0.02, 0.02)})).turn_rad, 0.0);
}

}  // namespace
}  // namespace traction::input::test

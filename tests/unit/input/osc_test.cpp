// Messages and bundles as OSC 1.0 and TUIO have them.
#include "client/input/osc.h"
#include "client/input/tuio.h"
#include "tests/unit/input/touches.h"

#include <gtest/gtest.h>

#include <string>

namespace traction::input::test {
namespace {

std::string operator""_bytes(const char* text, std::size_t size) {
  return {text, size};
}

TEST(Osc, EncodesTheExamplesOfTheSpecification) {
  EXPECT_EQ(OscMessage("/oscillator/4/frequency").add({440.0}).bytes(),
            "/oscillator/4/frequency\0,f\0\0\x43\xdc\0\0"_bytes);
  EXPECT_EQ(OscMessage("/foo").add(1000).add(-1).add("hello").add({1.234, 5.678}).bytes(),
            "/foo\0\0\0\0,iisff\0\0\0\0\x03\xe8\xff\xff\xff\xffhello\0\0\0\x3f\x9d\xf3\xb6\x40\xb5\xb2\x2d"_bytes);
  EXPECT_EQ(bundleOf({OscMessage("/a")}), "#bundle\0\0\0\0\0\0\0\0\1\0\0\0\x08/a\0\0,\0\0\0"_bytes);
  EXPECT_EQ(OscMessage("/t").addTime(1'500'000'000).bytes(), "/t\0\0,t\0\0\x83\xaa\x7e\x81\x80\0\0\0"_bytes);
}

TEST(Osc, RefusesWhatIsNoAddressToSendTo) {
  for (const char* const address :
       {"localhost", "127.0.0.1:", "127.0.0.1:port", "127.0.0.1:99999", "127.0.0.1:0", "no.such.host.invalid:1"}) {
    const auto datagrams = Datagrams::open(address);
    ASSERT_FALSE(datagrams) << address;
    EXPECT_EQ(datagrams.error().exitCode, EX_CONFIG);
  }
  EXPECT_TRUE(Datagrams::open("[::1]:3333") || Datagrams::open("127.0.0.1:3333"));
}

TEST(Tuio, PlacesAreFractionsFromTheUpperLeftCorner) {
  const Area area{{0.06, 0.03}};
  EXPECT_EQ(area.fractions({-0.03, 0.015}), (std::array{0.0, 0.0}));
  EXPECT_EQ(area.fractions({0.015, 0.0}), (std::array{0.75, 0.5}));
  EXPECT_EQ(area.fractions({1.0, -1.0}), (std::array{1.0, 1.0}));
}

TEST(Tuio, ABundleListsWhatIsAliveAndLastItsNumber) {
  const Area area;
  const Touches two = fieldOf({touchOf(3, 0.0, 0.0), touchOf(5, 0.01, 0.0)});
  const auto touched = tuio11(two, motionsOf(two, {}, area, 10.0), area, 9);
  ASSERT_EQ(touched.size(), 5U);
  EXPECT_EQ(touched[1].bytes(), OscMessage("/tuio/2Dcur").add("alive").add(3).add(5).bytes());
  EXPECT_EQ(touched[2].bytes(), OscMessage("/tuio/2Dcur").add("set").add(3).add({0.5, 0.5, 0.0, -0.0, 0.0}).bytes());
  EXPECT_EQ(touched[4].bytes(), OscMessage("/tuio/2Dcur").add("fseq").add(9).bytes());
  const auto lifted = tuio20(fieldOf({}), {}, area, 10, 0);
  ASSERT_EQ(lifted.size(), 2U);
  EXPECT_EQ(lifted[1].bytes(), OscMessage("/tuio2/alv").bytes());
}

TEST(Tuio, SpeedsAndAccelerationsAreThoseOfTheTouchInSizesOfTheArea) {
  // Away from the user from rest at 0.03 m/s^2 for a second, while the press grows by 8 N/s^2 from nothing.
  const Area area{{0.06, 0.03}};
  Motions motions;
  Touches field;
  for (int frame = 0; frame <= 60; ++frame) {
    const double time_s = frame / 60.0;
    Touch touch = touchOf(4, 0.0, 0.0, 4.0 * time_s * time_s);
    touch.velocity_m_s = {0.0, 0.03 * time_s};
    touch.seen = frame % 10 != 5;
    if (!touch.seen) touch.press_N = 0.0;
    field = fieldOf({touch}, (1 + frame) * kFrame_ns);
    motions = motionsOf(field, motions, area, 10.0);
  }
  const Motion& motion = motions.at(4);
  EXPECT_DOUBLE_EQ(motion.velocity[1], -1.0);
  EXPECT_NEAR(motion.acceleration, 1.0, 0.02);
  EXPECT_NEAR(motion.pressSpeed, 0.8, 0.05);  // as it was 50 ms ago
  EXPECT_NEAR(motion.pressAcceleration, 0.8, 0.02);
  const auto pointer = tuio20(field, motions, area, 1, 0).at(1).bytes();
  EXPECT_NE(pointer.find(",iiifffffffffff\0"_bytes), std::string::npos);
  EXPECT_TRUE(motionsOf(fieldOf({}), motions, area, 10.0).empty());
}

}  // namespace
}  // namespace traction::input::test

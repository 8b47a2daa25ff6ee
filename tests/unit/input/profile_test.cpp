// Profiles: those that are shipped, and what is wrong with others.
#include "client/input/profile.h"
#include "tests/support/places.h"

#include <gtest/gtest.h>
#include <sysexits.h>

#include <string>

namespace traction::input::test {
namespace {

TEST(Profile, ThoseThatAreShippedHaveTheirOutputs) {
  const auto load = [](const std::string& name) {
    auto profile = loadProfile(tractiond::test::source("config/input/" + name + ".toml"));
    EXPECT_TRUE(profile) << profile.error().message();
    return profile ? *profile : Profile{};
  };
  const Profile mouse = load("mouse"), touch = load("touch"), tablet = load("tablet"), puck = load("puck");
  EXPECT_TRUE(mouse.pointer && mouse.touch && !mouse.pen);
  EXPECT_TRUE(touch.touch && !touch.pointer && touch.tuio11 && touch.tuio20);
  EXPECT_TRUE(tablet.pen && !tablet.touch);
  EXPECT_TRUE(puck.spacenav && !puck.pointer);
  const Profile music = load("music");
  EXPECT_TRUE(music.osc);
  const Profile zoom = load("zoom");
  EXPECT_TRUE(zoom.zoom && !mouse.zoom);
  EXPECT_DOUBLE_EQ(zoom.zoom->gain, ZoomOptions{}.gain);
  EXPECT_DOUBLE_EQ(zoom.zoom->deadZone_Pa_m, ZoomOptions{}.deadZone_Pa_m);
  EXPECT_DOUBLE_EQ(music.osc->gradientDeadZone_Pa_m, OscOptions{}.gradientDeadZone_Pa_m);
  const Profile strokes = load("strokes");
  EXPECT_TRUE(strokes.text);
  // What they say is the default.
  EXPECT_EQ(mouse.pointer->decision_ns, PointerOptions{}.decision_ns);
  EXPECT_DOUBLE_EQ(mouse.pointer->speed_N, PointerOptions{}.speed_N);
  EXPECT_DOUBLE_EQ(puck.spacenav->axes.gain_Nm, AxesOptions{}.gain_Nm);
  EXPECT_DOUBLE_EQ(puck.spacenav->axes.deadZone_Nm, AxesOptions{}.deadZone_Nm);
  EXPECT_EQ(strokes.text->pressSymbols, TextOptions{}.pressSymbols);
  EXPECT_EQ(strokes.text->press.most_ns, PressOptions{}.most_ns);
  EXPECT_DOUBLE_EQ(strokes.text->press.turn_Nm, PressOptions{}.turn_Nm);
  EXPECT_DOUBLE_EQ(strokes.text->press.tap_N, PressOptions{}.tap_N);
  EXPECT_DOUBLE_EQ(touch.area.size_m[0], Area{}.size_m[0]);
}

TEST(Profile, AFaultIsNamedWithItsLine) {
  const auto errorOf = [](const std::string& text) {
    const auto profile = parseProfile(text, "my.toml");
    if (profile) return std::string();
    EXPECT_EQ(profile.error().exitCode, EX_CONFIG);
    return profile.error().message();
  };
  EXPECT_NE(errorOf("[pointer]\nspeed = 3\n").find("my.toml:2: "), std::string::npos);
  EXPECT_NE(errorOf("[pointr]\n").find("pointr"), std::string::npos);
  EXPECT_NE(errorOf("[pointer]\nrelease_N = 2\n").find("must be below press_N"), std::string::npos);
  EXPECT_NE(errorOf("[pen]\n[touch]\n").find("one device more"), std::string::npos);
  EXPECT_NE(errorOf("[text]\n[touch]\n").find("one device more"), std::string::npos);
  EXPECT_NE(errorOf("[text]\ntap = \"?\"\n").find("my.toml:2: "), std::string::npos);
  EXPECT_NE(errorOf("[text]\ntap_N = 5\n").find("must be above tap_N"), std::string::npos);
  EXPECT_NE(errorOf("area_mm = [0, 3]\n[pen]\n").find("my.toml:1: "), std::string::npos);
  EXPECT_NE(errorOf("").find("has no output"), std::string::npos);
  EXPECT_EQ(errorOf("[pointer]\n[touch]\n[osc]\n[spacenav]\n"), "");
  EXPECT_EQ(loadProfile("/nowhere.toml").error().exitCode, EX_NOINPUT);
  EXPECT_NE(loadProfile("nosuch").error().message().find("the shipped profiles are in"), std::string::npos);
}

}  // namespace
}  // namespace traction::input::test

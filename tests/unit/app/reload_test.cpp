#include "daemon/app/reload.h"

#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

namespace tractiond::reload_test {
namespace {

/// A configuration in force.
struct Fixture {
  Fixture() { inForce.camera.gain = 1.0; }
  ~Fixture() { spdlog::set_level(spdlog::level::info); }

  auto apply(const Config& config, const Id& gel = {}, bool hasRefused = false) {
    return tractiond::apply({config, gel}, inForce, {}, hasRefused);
  }

  Config inForce;
};

TEST(Reload, TakesWhatTheCameraAndTheLogMayTake) {
  Fixture fixture;
  Config next = fixture.inForce;
  next.camera.gain = 2.0;
  next.logLevel = "debug";
  const News news = fixture.apply(next).value();
  EXPECT_EQ(news.lines, (std::vector<std::string>{"camera.gain = 2 (was 1)", "log.level = \"debug\" (was \"info\")"}));
  EXPECT_TRUE(news.isOfCamera);
  EXPECT_EQ(fixture.inForce.camera.gain, 2.0);
  EXPECT_EQ(spdlog::get_level(), spdlog::level::debug);
  EXPECT_TRUE(fixture.apply(next).value().lines.empty());
  EXPECT_FALSE(fixture.apply(next).value().isOfCamera) << "nothing has changed";
}

TEST(Reload, TakesNothingWithAnotherGel) {
  Fixture fixture;
  Config next = fixture.inForce;
  next.camera.gain = 2.0;
  EXPECT_EQ(fixture.apply(next, {1}).error().what, "not while it runs: what sensor.gel_file holds");
  EXPECT_EQ(fixture.inForce.camera.gain, 1.0);
}

TEST(Reload, TriesOnceMoreWhatTheCameraRefused) {
  Fixture fixture;
  const News news = fixture.apply(Config(fixture.inForce), {}, true).value();
  EXPECT_EQ(news.lines.size(), 1U);
  EXPECT_TRUE(news.isOfCamera);
}

TEST(Reload, LeavesACameraAloneThatIsAPipe) {
  Fixture fixture;
  fixture.inForce.camera.images = "-";
  Config next = fixture.inForce;
  next.camera.gain = 2.0;
  EXPECT_EQ(fixture.apply(next).error().what, "not while it runs: camera.gain");
}

}  // namespace
}  // namespace tractiond::reload_test

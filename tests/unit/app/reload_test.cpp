#include "daemon/app/reload.h"

#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

namespace tractiond::reload_test {
namespace {

/// A configuration in force, and a camera that it is given to.
struct Fixture final : ReloadedCamera {
  Fixture() { inForce.camera.gain = 1.0; }
  ~Fixture() { spdlog::set_level(spdlog::level::info); }

  tl::expected<std::vector<std::string>, Error> apply(const Config& config, const Id& gel = {}) {
    return reloader.apply({config, gel});
  }

  Config inForce;
  bool hasRefused() const override { return refuses; }
  void reopen() override { ++opened; }

  bool refuses = false;
  int opened = 0;
  Reloader reloader{inForce, {}, *this};
};

TEST(Reload, TakesWhatTheCameraAndTheLogMayTake) {
  Fixture fixture;
  Config next = fixture.inForce;
  next.camera.gain = 2.0;
  next.logLevel = "debug";
  EXPECT_EQ(fixture.apply(next).value(),
            (std::vector<std::string>{"camera.gain = 2 (was 1)", "log.level = \"debug\" (was \"info\")"}));
  EXPECT_EQ(fixture.opened, 1);
  EXPECT_EQ(fixture.inForce.camera.gain, 2.0);
  EXPECT_EQ(spdlog::get_level(), spdlog::level::debug);
  EXPECT_TRUE(fixture.apply(next).value().empty());
  EXPECT_EQ(fixture.opened, 1) << "nothing has changed";
}

TEST(Reload, TakesNothingWithAnotherGel) {
  Fixture fixture;
  Config next = fixture.inForce;
  next.camera.gain = 2.0;
  EXPECT_EQ(fixture.apply(next, {1}).error().what, "not while it runs: what sensor.gel_file holds");
  EXPECT_EQ(fixture.opened, 0);
  EXPECT_EQ(fixture.inForce.camera.gain, 1.0);
}

TEST(Reload, TriesOnceMoreWhatTheCameraRefused) {
  Fixture fixture;
  fixture.refuses = true;
  EXPECT_EQ(fixture.apply(fixture.inForce).value().size(), 1U);
  EXPECT_EQ(fixture.opened, 1);
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

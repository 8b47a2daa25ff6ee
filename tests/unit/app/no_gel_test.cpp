#include "daemon/app/adoption.h"
#include "daemon/app/config.h"
#include "daemon/app/gel_files.h"
#include "daemon/capture/camera.h"
#include "daemon/control/snapshots.h"
#include "daemon/track/rest_pose.h"
#include "daemon/track/rest_pose_file.h"
#include "tests/support/deadline.h"
#include "tests/support/places.h"
#include "tests/support/temporary_folder.h"
#include "traction/v1/status.pb.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <fstream>
#include <iostream>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

namespace tractiond::no_gel_test {
namespace {

using namespace std::chrono_literals;

/// What the control server would have been told.
struct Answers final : control::Replies {
  void answerZero(const tl::expected<RestPose, std::string>& /*result*/, const std::string& /*remark*/) override {}
  void answerCalibration(const tl::expected<CalibrationReport, std::string>& /*result*/) override {}
  void answerSnapshot(const tl::expected<const Snapshot*, std::string>& result,
                      const std::vector<sensor::MarkerLayer>& /*layers*/) override {
    if (!result) return reasons.push_back(result.error());
    ++pictures;
  }
  std::vector<std::string> reasons;
  int pictures = 0;
};

TEST(NoGel, IsAGelFileCalledNone) {
  const auto none = loadGel(std::string(kNoGelFile)), paper = loadGel("");
  ASSERT_TRUE(none && paper);
  EXPECT_FALSE(none->has_value());
  EXPECT_TRUE(paper->has_value());
  const auto forces = loadSensor(std::string(kNoGelFile));  // of a replay
  ASSERT_FALSE(forces);
  EXPECT_EQ(forces.error().exitCode, EX_CONFIG);
}

std::int64_t now_ns = 0;

class SnapshotsTest : public testing::Test {
 protected:
  SnapshotsTest() { now_ns = 1'000'000'000; }

  void arrive() {
    Frame frame;
    frame.data = bytes_.data();
    frame.size = bytes_.size();
    if (Snapshot* const room = snapshots_.lent()) {
      room->copyFrom(frame);
      snapshots_.giveBack();
    }
  }

  const std::vector<std::uint8_t> bytes_ = std::vector<std::uint8_t>(12, 31);
  Answers answers_;
  control::Snapshots snapshots_{&answers_, {}, [] { return now_ns; }};
};

TEST_F(SnapshotsTest, AreRefusedWhereNoFrameComesAndServeThoseWhoAskLater) {
  snapshots_.ask();
  snapshots_.turn();
  now_ns += 3'000'000'000;
  snapshots_.turn();
  EXPECT_TRUE(answers_.reasons.empty());
  now_ns += 1;
  snapshots_.turn();
  EXPECT_EQ(answers_.reasons, std::vector<std::string>{"no frames come from the camera"});
  snapshots_.ask();
  for (int i = 0; i < 3; ++i) {
    arrive();
    snapshots_.take();
    snapshots_.turn();
  }
  EXPECT_EQ(answers_.pictures, 1);
  EXPECT_EQ(answers_.reasons.size(), 1U);
  arrive();
  EXPECT_EQ(snapshots_.take(), nullptr);  // nobody wants one
}

TEST_F(SnapshotsTest, OfATriggeredCameraTakeOneFrameOrSayWhatItWaitsFor) {
  snapshots_.setCamera(bytes_.size(), "it waits for triggers");
  snapshots_.ask();
  snapshots_.turn();
  arrive();
  snapshots_.take();
  EXPECT_EQ(answers_.pictures, 1);
  snapshots_.ask();
  now_ns += 3'000'000'001;
  snapshots_.turn();
  EXPECT_EQ(answers_.reasons, std::vector<std::string>{"no frames come from the camera: it waits for triggers"});
}

/// A gel file that the daemon could not start with again is not kept.
capture::CameraInfo cameraOfTheGel() {
  capture::CameraInfo camera;
  camera.name.vendor = "Vendor";
  camera.name.serial = "1";
  camera.shape.width = 640;
  camera.shape.height = 480;
  camera.format = PixelFormat::kRgb8;
  return camera;
}

TEST(GelFiles, OnlyOneOfThisCameraThatReadsNoOtherFileIsAdopted) {
  capture::CameraInfo camera = cameraOfTheGel();
  const auto why = [&camera](const std::string& text) {
    const auto checked = readAdopted(text, camera);
    return checked ? std::string() : checked.error().what;
  };
  const std::string gel = "format = 1\n";
  EXPECT_EQ(why(gel), "");
  EXPECT_NE(why("format = "), "");
  EXPECT_THAT(why(gel + "[camera]\nwidth_px = 641\n"), testing::HasSubstr("the gel's is 641 x 480"));
  const std::string bound = gel + "[camera]\nmeasured_with = \"Vendor-1 (640 x 480 px)\"\n";
  EXPECT_EQ(why(bound), "");
  camera.cut = ", BinningVertical = 2";
  EXPECT_EQ(why(bound),
            "the gel file's camera was measured with Vendor-1 (640 x 480 px), this is Vendor-1 (640 x 480 px, "
            "BinningVertical = 2)");
  EXPECT_EQ(why(gel + "[camera]\nmeasured_with = \"Vendor-1\"\n"), "") << "the picture is not known";
  camera.name.serial = "2";
  EXPECT_NE(why(bound), "");
  camera.format = PixelFormat::kMono8;
  EXPECT_NE(why(gel), "") << "two colours";
}

tl::expected<void, std::string> outcomeOf(Adoption& adoption) {
  std::optional<tl::expected<void, std::string>> kept;
  EXPECT_TRUE(test::eventually([&] {
    std::this_thread::yield();
    kept = adoption.turn();
    return kept.has_value();
  }));
  return kept.value_or(tl::unexpected(std::string("neither kept nor refused")));
}

std::string textOf(const std::filesystem::path& file) {
  std::ifstream stream(file);
  return std::string(std::istreambuf_iterator<char>(stream), {});
}

std::string program() {
  return test::built("bin/tractiond");
}

TEST(Adoption, IsDueWhenTheFileIsKeptAndTheAnswerHasHadItsTime) {
  const test::TemporaryFolder folder;
  Adoption adoption(program());
  EXPECT_EQ(adoption.turn(), std::nullopt);
  const capture::CameraInfo camera = cameraOfTheGel();
  const std::string with = measuredWith(camera).text(), gel = "format = 1\n";
  adoption.begin(folder.path() / "absent/adopted.toml", gel, camera);
  EXPECT_THAT(outcomeOf(adoption).error(), testing::HasSubstr("cannot be written"));
  EXPECT_FALSE(adoption.isDue());
  const auto zero = track::restPosePath(folder.path()), earlier = track::earlierPosePath(folder.path());
  const sensor::Sensor sensor;
  RestPose pose;
  pose.position_px.resize(2 * static_cast<std::size_t>(sensor.markerCount()));
  pose.present.resize(static_cast<std::size_t>(sensor.markerCount()));
  pose.amplitude.resize(pose.present.size());
  pose.noise = 1.0F;
  pose.id = track::idOf(pose);
  sensor::Sensor other;
  other.layers[0].diameter *= 2.0;
  ASSERT_TRUE(track::saveRestPose(zero, pose, sensor, camera.format, with));
  ASSERT_TRUE(track::saveRestPose(earlier, pose, other, camera.format, with));
  adoption.begin(folder.path() / "adopted.toml", gel, camera);
  const auto kept = outcomeOf(adoption);
  EXPECT_TRUE(kept) << kept.error();
  EXPECT_EQ(adoption.turn(), std::nullopt);
  EXPECT_TRUE(std::filesystem::exists(zero)) << "of the same markers";
  EXPECT_FALSE(std::filesystem::exists(earlier)) << "of others";
  EXPECT_TRUE(test::eventually([&] {
    std::this_thread::yield();
    return adoption.isDue();
  }));
  EXPECT_EQ(textOf(folder.path() / "adopted.toml"), gel);
}

/// Whatever a gel file does to what reads it, it does to a child process.
TEST(Adoption, RefusesWhatWouldEndOrFillTheDaemonOrReadAnotherFile) {
  const test::TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "adopted.toml";
  std::string deep = "format = 1\n", surfaces = deep + "[camera]\nposition_mm = [0, 0, 9000]\n",
              inline_ = deep + "a = ";
  for (int i = 0; i < 16000; ++i) deep += "\"=\".a.";
  for (int i = 0; i < 1000; ++i)
    surfaces += "[[camera.surfaces]]\ncentre_mm = [0, 0, " + std::to_string(i + 50) + "]\nindex = 1\n";
  for (int i = 0; i < 10000; ++i) inline_ += "{a=";
  std::string nested = "format = 1\n", parts = "a";
  for (int i = 0; i < 2000; ++i) parts += ".a";
  for (int i = 0; i < 14; ++i) nested += (i == 0 ? parts + "=[" : "{" + parts + "=[") + "\n";
  for (int i = 0; i < 14; ++i) nested += i == 13 ? "]" : "]}";
  const std::string layer = "[[layers]]\ncolour = \"blue\"\ndepth_mm = 2\n";
  const std::vector<std::array<std::string, 3>> attacks{
      {"a key of 32,000 parts, quoted", deep + "a = 1\n", "more than 100 tables"},
      {"100 x 100 nodes", "format = 1\n[nodes]\ncolumns = 100\nrows = 100\npitch_mm = 0.4\n", "GiB"},
      {"a million markers",
       "format = 1\n" + layer + "columns = 1000\nrows = 1000\npitch_mm = 0.04\ndiameter_mm = 0.03\n",
       "markers of 0.2 px"},
      {"an escaped key", "format = 1\n[gel]\n\"influence\\u005ffile\" = \"/etc/shadow\"\n", "must not be named"},
      {"an influence file", "format = 1\n[gel]\ninfluence_file = \"/dev/zero\"\n", "must not be named"},
      {"1,000 surfaces", surfaces, "the gel file"},
      {"10,000 inline tables", inline_ + "\n", "the gel file"},
      {"keys of 2,000 parts in lists", nested, "the gel file"},
      {"no number", "format = 1\n[gel]\nyoungs_modulus_pa = nan\n", "the gel file"},
  };
  for (const auto& [name, text, why] : attacks) {
    Adoption adoption(program());
    const auto asked = std::chrono::steady_clock::now();
    adoption.begin(path, text, cameraOfTheGel());
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - asked;
    const auto kept = outcomeOf(adoption);
    ASSERT_FALSE(kept) << name;
    EXPECT_THAT(kept.error(), testing::HasSubstr(why)) << name;
    EXPECT_FALSE(std::filesystem::exists(path)) << name;
    std::cout << fmt::format("  adopt {}: {:.0f} ms of the control thread, {}; right: refused, the daemon lives\n",
                             name, took.count(), kept.error());
  }
}

/// A gel file that passed, and with which the daemon ends all the same.
TEST(Adoption, IsTakenBackAfterTwoStartsThatDidNotRun) {
  const test::TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "adopted.toml";
  const auto adopt = [&](const std::string& text) {
    Adoption adoption(program());
    adoption.begin(path, text, cameraOfTheGel());
    const auto kept = outcomeOf(adoption);
    EXPECT_TRUE(kept) << kept.error();
  };
  const std::string first = "format = 1\n", second = "format = 1\n# second\n", third = "format = 1\n# third\n";
  adopt(first);
  EXPECT_EQ(countStart(path), "");
  forgetStart(path);  // no camera
  EXPECT_EQ(countStart(path), "");
  endTrial(path);
  EXPECT_FALSE(isOnTrial(path));
  for (int start = 0; start < 9; ++start) EXPECT_EQ(countStart(path), "") << "it has run";
  for (const std::string& text : {second, third}) {
    adopt(text);
    EXPECT_EQ(textOf(earlierGel(path)), first) << "the last that has run";
  }
  EXPECT_EQ(countStart(path), "");
  EXPECT_EQ(countStart(path), "");
  EXPECT_THAT(countStart(path), testing::HasSubstr("the one before is in force again"));
  EXPECT_EQ(textOf(path), first);
  EXPECT_EQ(textOf(path.string() + ".refused"), third);
  EXPECT_FALSE(isOnTrial(path));
  adopt(second);
  std::filesystem::remove(path);  // as docs/calibration.md says, for another lens
  adopt(third);
  EXPECT_FALSE(std::filesystem::exists(earlierGel(path))) << "what was taken away does not come back";
}

/// A recording without it would be replayed with the built-in gel.
TEST(GelFiles, OneThatCannotBeReadIsAnError) {
  const test::TemporaryFolder folder;
  const std::string gel = folder.path() / "gel.toml";
  std::ofstream(gel) << "format = 1\n";
  publish::Beginning beginning;
  EXPECT_TRUE(readGelFiles({}, "", beginning)) << "the built-in one";
  EXPECT_TRUE(readGelFiles({}, gel, beginning));
  EXPECT_EQ(beginning.message.gel(), "format = 1\n");
  std::filesystem::remove(gel);
  const auto read = readGelFiles({}, gel, beginning);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().exitCode, EX_NOINPUT);
  EXPECT_EQ(read.error().where, gel);
  EXPECT_EQ(beginning.message.gel(), "");
}

}  // namespace
}  // namespace tractiond::no_gel_test

#include "daemon/app/adoption.h"
#include "daemon/app/config.h"
#include "daemon/app/gel_files.h"
#include "daemon/capture/camera.h"
#include "daemon/control/snapshots.h"
#include "daemon/track/rest_pose.h"
#include "daemon/track/rest_pose_file.h"
#include "tests/support/deadline.h"
#include "tests/support/temporary_folder.h"
#include "traction/v1/status.pb.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
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
TEST(GelFiles, OnlyOneOfThisCameraThatReadsNoOtherFileIsAdopted) {
  capture::CameraInfo camera;
  camera.name.vendor = "Vendor";
  camera.name.serial = "1";
  camera.shape.width = 640;
  camera.shape.height = 480;
  camera.format = PixelFormat::kRgb8;
  const auto why = [&camera](const std::string& text) {
    const auto checked = readAdopted(text, camera);
    return checked ? std::string() : checked.error().what;
  };
  const std::string gel = "format = 1\n";
  EXPECT_EQ(why(gel), "");
  EXPECT_NE(why("format = "), "");
  EXPECT_THAT(why(gel + "[gel]\ninfluence_file = \"/etc/shadow\"\n"), testing::HasSubstr("influence file"));
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

TEST(Adoption, IsDueWhenTheFileIsKeptAndTheAnswerHasHadItsTime) {
  const test::TemporaryFolder folder;
  const auto outcome = [](Adoption& adoption) {
    std::optional<tl::expected<void, std::string>> kept;
    EXPECT_TRUE(test::eventually([&] {
      std::this_thread::yield();
      kept = adoption.turn();
      return kept.has_value();
    }));
    return kept.value_or(tl::unexpected(std::string("neither kept nor refused")));
  };
  Adoption adoption;
  EXPECT_EQ(adoption.turn(), std::nullopt);
  const Adopted gel{.gelFile = "format = 1\n", .sensor = {}, .format = PixelFormat::kRgb8, .camera = "Vendor-1"};
  adoption.begin(folder.path() / "absent/adopted.toml", gel);
  EXPECT_THAT(outcome(adoption).error(), testing::HasSubstr("cannot be written"));
  EXPECT_FALSE(adoption.isDue());
  const auto zero = track::restPosePath(folder.path()), earlier = track::earlierPosePath(folder.path());
  RestPose pose;
  pose.position_px.resize(2 * static_cast<std::size_t>(gel.sensor.markerCount()));
  pose.present.resize(static_cast<std::size_t>(gel.sensor.markerCount()));
  pose.amplitude.resize(pose.present.size());
  pose.noise = 1.0F;
  pose.id = track::idOf(pose);
  sensor::Sensor other;
  other.layers[0].diameter *= 2.0;
  ASSERT_TRUE(track::saveRestPose(zero, pose, gel.sensor, gel.format, gel.camera));
  ASSERT_TRUE(track::saveRestPose(earlier, pose, other, gel.format, gel.camera));
  adoption.begin(folder.path() / "adopted.toml", gel);
  EXPECT_TRUE(outcome(adoption));
  EXPECT_EQ(adoption.turn(), std::nullopt);
  EXPECT_TRUE(std::filesystem::exists(zero)) << "of the same markers";
  EXPECT_FALSE(std::filesystem::exists(earlier)) << "of others";
  EXPECT_TRUE(test::eventually([&] {
    std::this_thread::yield();
    return adoption.isDue();
  }));
  std::ifstream kept(folder.path() / "adopted.toml");
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(kept), {}), "format = 1\n");
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

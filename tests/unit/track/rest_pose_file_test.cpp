#include "daemon/control/zero_store.h"
#include "daemon/track/rest_pose.h"
#include "daemon/track/rest_pose_file.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <fstream>
#include <limits>

namespace tractiond::track::rest_pose_file_test {
namespace {

namespace fs = std::filesystem;

class RestPoseFile : public testing::Test {
 protected:
  RestPose pose() const {
    RestPose pose;
    const auto count = static_cast<std::size_t>(sensor_.markerCount());
    for (std::size_t i = 0; i < count; ++i) {
      pose.position_px.push_back(static_cast<float>(i));
      pose.position_px.push_back(0.5F * static_cast<float>(i));
      pose.amplitude.push_back(100.0F + static_cast<float>(i % 7));
      pose.present.push_back(i % 10 != 0);
      pose.oddity.push_back(0.01F * static_cast<float>(i % 5));
    }
    pose.noise = 2.1F;
    pose.shotNoise = 0.03F;
    pose.light = 120.0F;
    pose.crossTalk = {0.2F, 0.1F};
    pose.taken_ns = 1234567890123456789;
    pose.requested = true;
    pose.requestedBy = "uid 1000, pid 4711";
    pose.id = idOf(pose);
    return pose;
  }

  std::string contents() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void write(const std::string& bytes) const { std::ofstream(path_, std::ios::binary) << bytes; }

  auto load() const { return loadRestPose(path_, sensor_, PixelFormat::kRgb8, "Camera-1"); }

  sensor::Sensor sensor_;
  const test::TemporaryFolder temporary_;
  const fs::path directory_ = temporary_.path(), path_ = restPosePath(directory_ / "state");
};

TEST_F(RestPoseFile, NoFileIsNoPose) {
  const auto loaded = load();
  ASSERT_TRUE(loaded);
  EXPECT_FALSE(loaded->has_value());
}

TEST_F(RestPoseFile, ComesBackAsItWasSaved) {
  const RestPose saved = pose();
  ASSERT_TRUE(saveRestPose(path_, saved, sensor_, PixelFormat::kBgr8, "Camera-1"));
  const auto loaded = load();  // RGB8 and BGR8 are one family
  ASSERT_TRUE(loaded) << loaded.error().message();
  ASSERT_TRUE(loaded->has_value());
  EXPECT_EQ((*loaded)->position_px, saved.position_px);
  EXPECT_EQ((*loaded)->amplitude, saved.amplitude);
  EXPECT_EQ((*loaded)->present, saved.present);
  EXPECT_EQ((*loaded)->noise, saved.noise);
  EXPECT_EQ((*loaded)->shotNoise, saved.shotNoise);
  EXPECT_EQ((*loaded)->light, saved.light);
  EXPECT_EQ((*loaded)->oddity, saved.oddity);
  EXPECT_EQ((*loaded)->crossTalk, saved.crossTalk);
  EXPECT_EQ((*loaded)->taken_ns, saved.taken_ns);
  EXPECT_EQ((*loaded)->requested, saved.requested);
  EXPECT_EQ((*loaded)->requestedBy, saved.requestedBy);
  EXPECT_EQ((*loaded)->id, saved.id);
}

TEST_F(RestPoseFile, EveryTruncationAndEveryFlippedBitIsNoticed) {
  ASSERT_TRUE(saveRestPose(path_, pose(), sensor_, PixelFormat::kRgb8, "Camera-1"));
  const std::string whole = contents();
  const auto isNoticed = [&](const std::string& bytes) {
    write(bytes);
    const auto loaded = load();
    return !loaded && loaded.error().exitCode == EX_DATAERR && loaded.error().where == path_.string();
  };
  for (std::size_t at = 0; at < whole.size(); at += at < 200 ? 1 : 97) {
    std::string spoilt = whole;
    spoilt[at] = static_cast<char>(spoilt[at] ^ (1 << (at % 8)));
    ASSERT_TRUE(isNoticed(spoilt)) << at;
    ASSERT_TRUE(isNoticed(whole.substr(0, at))) << at;
  }
  EXPECT_TRUE(isNoticed(whole + 'x'));
}

TEST_F(RestPoseFile, AnotherSensorsOrPicturesIsForeign) {
  ASSERT_TRUE(saveRestPose(path_, pose(), sensor_, PixelFormat::kRgb8, "Camera-1"));
  sensor::Sensor other = sensor_;
  other.layers[0].columns = 12;
  other.layers[0].rows = 48;  // as many markers
  EXPECT_FALSE(loadRestPose(path_, other, PixelFormat::kRgb8, "Camera-1"));
  other = sensor_;
  other.camera.width = 1280;
  EXPECT_FALSE(loadRestPose(path_, other, PixelFormat::kRgb8, "Camera-1"));
  for (const PixelFormat format :
       {PixelFormat::kBayerRG8, PixelFormat::kRgb12, PixelFormat::kMono8, PixelFormat::kYuv422_8}) {
    EXPECT_FALSE(loadRestPose(path_, sensor_, format, "Camera-1")) << traitsOf(format).name;
  }
  other = sensor_;
  other.layers[0].darker = true;
  EXPECT_FALSE(loadRestPose(path_, other, PixelFormat::kRgb8, "Camera-1"));
  EXPECT_TRUE(loadRestPose(path_, sensor_, PixelFormat::kBgr8, "Camera-1"));
  EXPECT_TRUE(loadRestPose(path_, sensor_, PixelFormat::kRgb8, "Camera-1"));
}

TEST_F(RestPoseFile, AnotherCamerasIsForeign) {
  ASSERT_TRUE(saveRestPose(path_, pose(), sensor_, PixelFormat::kRgb8, "Camera-1"));
  for (const char* other : {"Camera-2", "Camera-11", "Camera-", ""}) {
    const auto loaded = loadRestPose(path_, sensor_, PixelFormat::kRgb8, other);
    ASSERT_FALSE(loaded);
    EXPECT_EQ(loaded.error().exitCode, EX_DATAERR);
    EXPECT_NE(loaded.error().what.find("Camera-1"), std::string::npos) << loaded.error().what;
  }
}

TEST_F(RestPoseFile, AnEarlierVersionDoesNotSayWhoseItIs) {
  ASSERT_TRUE(saveRestPose(path_, pose(), sensor_, PixelFormat::kRgb8, "Camera-1"));
  std::string bytes = contents();
  bytes[8] = 2;
  write(bytes);
  const auto loaded = load();
  ASSERT_FALSE(loaded);
  EXPECT_NE(loaded.error().what.find("earlier version, which does not say whose camera"), std::string::npos);
  EXPECT_NE(loaded.error().remedy.find("tractionctl zero"), std::string::npos);
}

TEST_F(RestPoseFile, AnEarlierVersionWithoutOdditiesIsRead) {
  RestPose earlier = pose();
  earlier.oddity.clear();
  earlier.id = idOf(earlier);
  ASSERT_TRUE(saveRestPose(path_, earlier, sensor_, PixelFormat::kRgb8, "Camera-1"));
  EXPECT_EQ(contents()[8], 3);
  const auto loaded = load();
  ASSERT_TRUE(loaded && *loaded);
  EXPECT_EQ((*loaded)->id, earlier.id);
  EXPECT_TRUE((*loaded)->oddity.empty());
  EXPECT_EQ((*loaded)->amplitude, earlier.amplitude);
}

TEST_F(RestPoseFile, NumbersThatMakeNoSenseAreNotBelieved) {
  RestPose wrong = pose();
  wrong.position_px[17] = std::numeric_limits<float>::quiet_NaN();
  wrong.id = idOf(wrong);
  ASSERT_TRUE(saveRestPose(path_, wrong, sensor_, PixelFormat::kRgb8, "Camera-1"));
  EXPECT_FALSE(load());
}

TEST_F(RestPoseFile, AZeroThatReplacedNothingYetIsNotUndone) {
  const fs::path state = directory_ / "state";
  const control::ZeroOwner owner{sensor_, PixelFormat::kRgb8, "Camera-1"};
  const RestPose before = pose();
  RestPose zero = before;
  zero.taken_ns += 1;
  zero.id = idOf(zero);
  ASSERT_TRUE(control::saveZeros(state, zero, &before, owner));
  EXPECT_EQ(load().value()->id, zero.id);
  const auto restored = control::restoreZero(state, owner);
  ASSERT_TRUE(restored) << restored.error().message();
  EXPECT_EQ(restored.value()->id, zero.id);
  EXPECT_EQ(control::loadEarlierZero(state, zero, owner).value()->id, before.id);
  // The power was lost after the first of the two files.
  ASSERT_TRUE(control::saveZeros(state, before, nullptr, owner));
  EXPECT_FALSE(control::loadEarlierZero(state, before, owner).value());
}

TEST_F(RestPoseFile, IdsDifferWhereAnythingDiffers) {
  const RestPose one = pose();
  RestPose other = one;
  other.requested = false;
  EXPECT_NE(idOf(other), one.id);
  other = one;
  other.position_px[100] += 0.001F;
  EXPECT_NE(idOf(other), one.id);
  other = one;
  other.taken_ns += 1;
  EXPECT_NE(idOf(other), one.id);
  other = one;
  other.oddity[3] += 0.001F;
  EXPECT_NE(idOf(other), one.id);
}

}  // namespace
}  // namespace tractiond::track::rest_pose_file_test

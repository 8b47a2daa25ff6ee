#include "daemon/control/zero_store.h"
#include "daemon/track/rest_pose.h"
#include "daemon/track/rest_pose_file.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <initializer_list>

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

  void save(const RestPose& pose) const {
    ASSERT_TRUE(saveRestPose(path_, pose, sensor_, PixelFormat::kRgb8, "Camera-1"));
  }
  auto load() const { return loadRestPose(path_, sensor_, PixelFormat::kRgb8, "Camera-1"); }

  sensor::Sensor sensor_;
  const test::TemporaryFolder temporary_;
  const fs::path directory_ = temporary_.path(), path_ = restPosePath(directory_ / "state");
};

TEST_F(RestPoseFile, ComesBackAsItWasSaved) {
  ASSERT_TRUE(load());
  EXPECT_FALSE(load()->has_value()) << "there is no file yet";
  const RestPose saved = pose();
  save(saved);
  const auto loaded = loadRestPose(path_, sensor_, PixelFormat::kBgr8, "Camera-1");  // RGB8 and BGR8 are one family
  ASSERT_TRUE(loaded && *loaded) << loaded.error().message();
  EXPECT_EQ(idOf(**loaded), saved.id);  // which is that of all else
  EXPECT_EQ((*loaded)->id, saved.id);
  EXPECT_EQ((*loaded)->requestedBy, saved.requestedBy);
}

TEST_F(RestPoseFile, EveryTruncationAndEveryFlippedBitIsNoticed) {
  save(pose());
  const std::string whole = contents();
  const auto isNoticed = [&](const std::string& bytes) {
    write(bytes);
    const auto loaded = load();
    return !loaded && loaded.error().exitCode == EX_DATAERR && loaded.error().where == path_.string();
  };
  for (std::size_t at = 0; at < whole.size(); at += at < 200 ? 1 : 397) {
    std::string spoilt = whole;
    spoilt[at] = static_cast<char>(spoilt[at] ^ (1 << (at % 8)));
    ASSERT_TRUE(isNoticed(spoilt)) << at;
    ASSERT_TRUE(isNoticed(whole.substr(0, at))) << at;
  }
  EXPECT_TRUE(isNoticed(whole + 'x'));
}

TEST_F(RestPoseFile, AnotherSensorsOrPicturesIsForeign) {
  save(pose());
  const auto isForeign = [&](PixelFormat format, const std::function<void(sensor::Sensor&)>& change) {
    sensor::Sensor other = sensor_;
    change(other);
    return !loadRestPose(path_, other, format, "Camera-1");
  };
  EXPECT_TRUE(isForeign(PixelFormat::kRgb8, [](auto& other) {
    other.layers[0].columns = 12;
    other.layers[0].rows = 48;  // as many markers
  }));
  EXPECT_TRUE(isForeign(PixelFormat::kRgb8, [](auto& other) { other.camera.width = 1280; }));
  EXPECT_TRUE(isForeign(PixelFormat::kRgb8, [](auto& other) { other.layers[0].darker = true; }));
  for (const PixelFormat format :
       {PixelFormat::kBayerRG8, PixelFormat::kRgb12, PixelFormat::kMono8, PixelFormat::kYuv422_8}) {
    EXPECT_TRUE(isForeign(format, [](auto&) {})) << traitsOf(format).name;
  }
}

TEST_F(RestPoseFile, AnotherCamerasIsForeign) {
  save(pose());
  for (const char* other : {"Camera-2", "Camera-11", "Camera-", ""}) {
    const auto loaded = loadRestPose(path_, sensor_, PixelFormat::kRgb8, other);
    ASSERT_FALSE(loaded);
    EXPECT_EQ(loaded.error().exitCode, EX_DATAERR);
    EXPECT_NE(loaded.error().what.find("Camera-1"), std::string::npos) << loaded.error().what;
  }
}

TEST_F(RestPoseFile, AnotherCutOfTheCamerasPictureIsForeign) {
  const std::string plain = "Camera-1 (640 x 480 px)", mirrored = "Camera-1 (640 x 480 px, ReverseX = true)";
  const auto loadAs = [this](const std::string& camera) {
    return loadRestPose(path_, sensor_, PixelFormat::kRgb8, camera);
  };
  ASSERT_TRUE(saveRestPose(path_, pose(), sensor_, PixelFormat::kRgb8, plain));
  EXPECT_TRUE(loadAs(plain));
  ASSERT_FALSE(loadAs(mirrored));
  EXPECT_EQ(loadAs(mirrored).error().what, "the rest pose was taken with camera " + plain + ", this is " + mirrored);
  std::printf("  a zero, then ReverseX: %s; right: refused by name\n", loadAs(mirrored).error().what.c_str());
  save(pose());  // as versions before did
  EXPECT_TRUE(loadAs(mirrored));
}

TEST_F(RestPoseFile, AnEarlierVersionWithoutOdditiesIsRead) {
  RestPose earlier = pose();
  earlier.oddity.clear();
  earlier.id = idOf(earlier);
  save(earlier);
  EXPECT_EQ(contents()[8], 3);
  const auto loaded = load();
  ASSERT_TRUE(loaded && *loaded);
  EXPECT_EQ((*loaded)->id, earlier.id);
  EXPECT_TRUE((*loaded)->oddity.empty());
  EXPECT_EQ((*loaded)->amplitude, earlier.amplitude);
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
  for (const auto& change : std::initializer_list<void (*)(RestPose&)>{
           [](RestPose& other) { other.requested = false; }, [](RestPose& other) { other.position_px[100] += 0.001F; },
           [](RestPose& other) { other.taken_ns += 1; }, [](RestPose& other) { other.oddity[3] += 0.001F; }}) {
    RestPose other = one;
    change(other);
    EXPECT_NE(idOf(other), one.id);
  }
}

}  // namespace
}  // namespace tractiond::track::rest_pose_file_test

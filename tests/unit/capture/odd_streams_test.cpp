// Cameras that send something else than was agreed upon: their pictures come through byte by byte, or what they send is
// named. They send picture after picture until the test ends, so that no test depends on when one comes.
#include "base/clock.h"
#include "tests/support/deadline.h"
#include "tests/unit/capture/quirks.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <bit>
#include <functional>
#include <set>

namespace tractiond::capture::odd_streams_test {
namespace {

using std::chrono::milliseconds;
using test::GvTransmitter;
using testing::Contains;
using testing::HasSubstr;
using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kRow = std::size_t{kWidth} * 3;

class OddStreams : public Quirks {
 protected:
  OddStreams() { sender_.resends = true; }
  ~OddStreams() override { stop(); }

  /// Pixels of a picture, which show its number.
  static Bytes pixels(std::uint16_t number) {
    std::mt19937 random(number);
    Bytes bytes(kPicture_bytes);
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
    return bytes;
  }

  /// Sends pictures from now on.
  /// \param change what is odd about them
  void stream(std::function<void(GvTransmitter::Picture&)> change = {}) {
    stop();
    ending_ = false;
    thread_ = std::thread([this, change = std::move(change)] {
      for (; !ending_; std::this_thread::sleep_for(milliseconds(3))) {
        if (!sender_.streaming()) continue;
        GvTransmitter::Picture one{
            .id = nextId_, .width = kWidth, .height = kHeight, .format = kRgb8Code, .bytes = pixels(nextId_)};
        one.device_ticks = static_cast<std::uint64_t>(monotonicNow());
        if (change) change(one);
        sender_.send(one);
        nextId_ = nextId_ == 65'535 ? 1 : static_cast<std::uint16_t>(nextId_ + 1);
      }
    });
  }
  void stop() {
    ending_ = true;
    if (thread_.joinable()) thread_.join();
  }

  /// Takes the next five pictures that are used; each must be the one that was sent.
  void expectPictures() {
    Frame frame;
    for (int taken = 0; taken < 5;) {
      ASSERT_TRUE(test::eventually([&] { return camera_->next(frame, milliseconds(100)) == Next::kFrame; }));
      const Bytes sent = pixels(static_cast<std::uint16_t>(frame.info.cameraFrameId));
      const auto stride = static_cast<std::size_t>(frame.stride);
      ASSERT_EQ(frame.size, stride * (kHeight - 1) + kRow);
      for (std::size_t row = 0; row < kHeight; ++row)
        ASSERT_TRUE(std::equal(frame.data + row * stride, frame.data + row * stride + kRow,
                               sent.begin() + static_cast<std::ptrdiff_t>(row * kRow)))
            << "row " << row;
      camera_->recycle(frame);
      ++taken;
    }
  }

  /// Opens the camera, which must be refused. Returns why. A machine that stands still while it is opened sees no
  /// frame.
  std::string refusal() {
    Error error;
    EXPECT_TRUE(test::eventually([&] {
      const auto camera = Camera::open(fromAravis(options_), {.wait = false}, ledger_);
      if (!camera) error = camera.error();
      return error.exitCode == EX_CONFIG;
    }));
    return error.message();
  }

  std::atomic<bool> ending_{false};
  std::thread thread_;
};

// ---------------------------------------------------------------- packets shorter than the size asked for

struct Rounding {
  int to_bytes;
  int payloadBeyond_bytes;  ///< of the payload size, beyond the picture
  int packetSize_bytes;     ///< 0: automatic
};

class Rounded : public OddStreams, public testing::WithParamInterface<Rounding> {};

TEST_P(Rounded, TheStreamIsOpenedForThePacketsThatCome) {
  sender_.roundsTo_bytes = GetParam().to_bytes;
  sender_.write(0x1f4, static_cast<std::uint32_t>(GetParam().payloadBeyond_bytes));
  options_.packetSize_bytes = GetParam().packetSize_bytes;
  stream();
  ASSERT_NO_FATAL_FAILURE(open());
  expectPictures();
  EXPECT_EQ((camera_->info()->packetSize_bytes - 36) % GetParam().to_bytes, 0);
}

INSTANTIATE_TEST_SUITE_P(Cameras, Rounded,
                         testing::Values(Rounding{16, 0, 1500}, Rounding{1024, 1464, 1500}, Rounding{1024, 9000, 0}),
                         [](const auto& one) {
                           return "to" + std::to_string(one.param.to_bytes) + "payload" +
                                  std::to_string(one.param.payloadBeyond_bytes) + "packets" +
                                  std::to_string(one.param.packetSize_bytes);
                         });

/// As of a camera that waits for its trigger: nothing comes while it is opened.
TEST_F(OddStreams, ShortPacketsAreNoticedWhenTheFirstFramesCome) {
  sender_.roundsTo_bytes = 1024;
  options_.silenceTimeout_ms = 0;
  ASSERT_NO_FATAL_FAILURE(open());
  stream();
  expectPictures();
  EXPECT_THAT(said(), Contains(HasSubstr("none of its frames is whole; it is opened again, to see why")));
  EXPECT_THAT(said(), Contains("camera: packets of 1500 bytes are asked for, it sends 1060"));
}

// ---------------------------------------------------------------- leaders

TEST_F(OddStreams, RowsWithPaddingAreReadByTheirStride) {
  constexpr std::size_t kPadding = 8;
  sender_.write(0x1f4, kPadding * kHeight + 100);
  stream([](GvTransmitter::Picture& one) {
    Bytes padded;
    for (std::size_t row = 0; row < kHeight; ++row) {
      const auto from = one.bytes.begin() + static_cast<std::ptrdiff_t>(row * kRow);
      padded.insert(padded.end(), from, from + kRow);
      padded.resize(padded.size() + kPadding, 0xaa);
    }
    padded.resize(padded.size() + 100, 0xbb);
    one.bytes = std::move(padded);
    one.paddingX = kPadding;
    one.paddingY = 100;
  });
  ASSERT_NO_FATAL_FAILURE(open());
  expectPictures();
}

/// Every second leader says that its picture is from elsewhere on the sensor.
TEST_F(OddStreams, PicturesOfTwoPlacesAreNotMixed) {
  stream([](GvTransmitter::Picture& one) { one.y = one.id % 2; });
  ASSERT_NO_FATAL_FAILURE(open());
  std::set<std::uint64_t> places;
  Frame frame;
  for (int taken = 0; taken < 5; ++taken) {
    ASSERT_TRUE(test::eventually([&] { return camera_->next(frame, milliseconds(100)) == Next::kFrame; }));
    places.insert(frame.info.cameraFrameId % 2);
    camera_->recycle(frame);
  }
  EXPECT_EQ(places.size(), 1U);
  EXPECT_GT(ledger_.wrongSize.get(), 0U);
}

// ---------------------------------------------------------------- payload types

TEST_F(OddStreams, ThePictureInChunkDataIsUsed) {
  sender_.write(0x1f4, 8 + 16);
  static constexpr double kExposure_us = 1234.0;
  stream([](GvTransmitter::Picture& one) {
    one.payloadType = 4;
    one.format = 0;
    append(one.bytes, 1, 4);
    append(one.bytes, kPicture_bytes, 4);
    appendChunk(one.bytes, 0x1001, std::bit_cast<std::uint64_t>(kExposure_us), 8);
  });
  ASSERT_NO_FATAL_FAILURE(open());
  expectPictures();
  Frame frame;
  ASSERT_TRUE(test::eventually([&] { return camera_->next(frame, milliseconds(100)) == Next::kFrame; }));
  EXPECT_NEAR(frame.info.exposure_s, 1e-6 * kExposure_us, 1e-12);
  camera_->recycle(frame);
}

// ---------------------------------------------------------------- refusals

/// A picture that cannot be used, and a part of what the operator reads.
struct Unusable {
  const char* name;
  GvTransmitter::Picture like;
  const char* why;
};

class UnusablePicture : public OddStreams, public testing::WithParamInterface<Unusable> {};

TEST_P(UnusablePicture, IsNamedWithWhatEndsIt) {
  stream([](GvTransmitter::Picture& one) {
    one.payloadType = GetParam().like.payloadType;
    one.dataKind = GetParam().like.dataKind;
    one.paddingX = GetParam().like.paddingX;
    one.height -= GetParam().like.height;
  });
  EXPECT_THAT(refusal(), HasSubstr(GetParam().why));
}

INSTANTIATE_TEST_SUITE_P(Cameras, UnusablePicture,
                         testing::Values(Unusable{"PaddingThatDoesNotCome", {.paddingX = 8}, "8 bytes behind each row"},
                                         Unusable{"AnotherSize", {.height = 1}, "64 x 47 pixels"},
                                         Unusable{"Jpeg", {.payloadType = 6}, "ImageCompressionMode"},
                                         Unusable{"MultiPart", {.payloadType = 10, .dataKind = 7}, "ComponentSelector"},
                                         Unusable{"GenDc", {.payloadType = 11, .dataKind = 8}, "GenDCStreamingMode"},
                                         Unusable{"MakersOwn", {.payloadType = 0x8001, .dataKind = 6}, "0x8001"}),
                         [](const auto& one) { return one.param.name; });

}  // namespace
}  // namespace tractiond::capture::odd_streams_test

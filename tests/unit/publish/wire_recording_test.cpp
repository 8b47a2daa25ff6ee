// What is recorded is read again exactly, and what is damaged is refused or harmless.
#include "daemon/publish/wire_recording.h"
#include "tests/support/seed.h"
#include "tests/unit/publish/support.h"

#include <gtest/gtest.h>

#include <random>

namespace tractiond::publish {
namespace {

class WireRecording : public ::testing::Test {
 protected:
  std::uint64_t any(std::uint64_t most) { return random_() % (most + 1); }

  static Beginning beginning() {
    Beginning one;
    one.message.set_calibration(bytesOf(idOf(20)));
    return one;
  }

  RestPose anyPose() {
    RestPose pose;
    const std::size_t markers = any(20);
    for (std::size_t i = 0; i < 2 * markers; ++i) pose.position_px.push_back(static_cast<float>(any(1000)) / 7.0F);
    for (std::size_t i = 0; i < markers; ++i) {
      pose.amplitude.push_back(static_cast<float>(any(1000)) / 9.0F);
      pose.oddity.push_back(static_cast<float>(any(1000)) / 9000.0F);
      pose.present.push_back(static_cast<std::uint8_t>(any(1)));
    }
    pose.noise = static_cast<float>(any(1000)) / 3.0F;
    pose.shotNoise = static_cast<float>(any(1000)) / 3.0F;
    pose.light = static_cast<float>(any(1000)) / 3.0F;
    pose.crossTalk = {0.1F, static_cast<float>(any(1000)) / 3.0F};
    pose.taken_ns = static_cast<std::int64_t>(random_() >> 1);
    pose.requested = any(1) == 1;
    pose.requestedBy = any(1) == 1 ? "somebody" : "";
    pose.id.fill(static_cast<std::uint8_t>(1 + any(254)));
    return pose;
  }

  TrackedFrame anyFrame() {
    const auto formats = pixelFormats();
    const PixelFormatTraits& format = formats[any(formats.size() - 1)];
    TrackedFrame one;
    Frame& frame = one.frame;
    frame.width = static_cast<int>(1 + any(40));
    frame.height = static_cast<int>(1 + any(30));
    frame.format = format.format;
    frame.stride = format.stride(frame.width);
    frame.size = format.size(frame.width, frame.height);
    one.bytes.resize(frame.size);
    for (std::uint8_t& byte : one.bytes) byte = static_cast<std::uint8_t>(any(255));
    frame.data = one.bytes.data();
    one.number = random_();
    FrameInfo& info = frame.info;
    info.cameraFrameId = random_();
    info.frameNumber = random_();
    info.exposure_s = 0.01;
    info.extras.hasGain = any(1) == 1;
    info.extras.gain = info.extras.hasGain ? 2.5 : 0.0;
    info.discontinuity = any(1) == 1;
    info.doubted = any(1) == 1;
    info.times.device_ns = static_cast<std::int64_t>(random_());
    info.times.received_ns = static_cast<std::int64_t>(random_());
    info.times.receivedReal_ns = static_cast<std::int64_t>(random_());
    info.times.captured_ns = static_cast<std::int64_t>(random_());
    info.times.capturedError_ns = static_cast<std::int64_t>(random_());
    info.times.capturedBound = static_cast<CaptureBound>(any(2));
    TrackerInputs& inputs = one.inputs;
    inputs.zeroBegun = any(1) == 1;
    inputs.zeroEnded = any(1) == 1;
    inputs.zeroForgone = any(1) == 1;
    inputs.compared = any(1) == 1;
    if (inputs.compared) inputs.comparedZero.fill(static_cast<std::uint8_t>(any(255)));
    inputs.fits = inputs.compared && any(1) == 1;
    inputs.adopted = any(1) == 1;
    if (inputs.adopted) inputs.zero = anyPose();
    one.places.fill(static_cast<std::uint8_t>(any(1) * any(255)));
    return one;
  }

  std::mt19937_64 random_{test::seed()};
};

TEST_F(WireRecording, APictureIsReadAgainExactly) {
  PictureMessage message(description().identity);
  TrackedFrame again;
  for (int i = 0; i < 300; ++i) {
    const TrackedFrame one = anyFrame();
    const auto read = decodePicture(message.encode(one, any(1) == 1), again);
    ASSERT_TRUE(read) << read.error().message();
    EXPECT_EQ(again.bytes, one.bytes);
    EXPECT_EQ(again.number, one.number);
    EXPECT_EQ(again.frame.width, one.frame.width);
    EXPECT_EQ(again.frame.height, one.frame.height);
    EXPECT_EQ(again.frame.stride, one.frame.stride);
    EXPECT_EQ(again.frame.size, one.frame.size);
    EXPECT_EQ(again.frame.format, one.frame.format);
    EXPECT_EQ(again.frame.info, one.frame.info);
    if (!one.inputs.adopted) again.inputs.zero = one.inputs.zero;  // that of an earlier picture
    if (!one.inputs.compared) again.inputs.comparedZero = one.inputs.comparedZero;
    EXPECT_EQ(again.inputs, one.inputs);
    EXPECT_EQ(again.places, one.places);
  }
}

TEST_F(WireRecording, ABeginningIsReadAgainExactly) {
  Beginning one = beginning();
  one.message.set_gel("format = 1");
  one.rest = anyPose();
  const auto again = decodeBeginning(encode(one));
  ASSERT_TRUE(again) << again.error().message();
  EXPECT_EQ(again->message.gel(), "format = 1");
  EXPECT_EQ(again->rest, one.rest);
  one.rest.reset();
  EXPECT_FALSE(decodeBeginning(encode(one))->rest);
}

TEST_F(WireRecording, OfEarlierVersionsItIsKnownWhatTheyDoNotState) {
  std::string bytes = encode(beginning());
  for (const int version : {1, 2, 3}) {
    bytes[1] = static_cast<char>(version);
    const auto read = decodeBeginning(bytes);
    ASSERT_TRUE(read) << read.error().message();
    EXPECT_EQ(read->adoptsAtOnce(), version < 2);
    EXPECT_EQ(read->statesPlaces(), version >= 3);
  }
}

TEST_F(WireRecording, ANewerVersionIsRefused) {
  std::string bytes = encode(beginning());
  ASSERT_EQ(bytes[0], '\x08');  // field 1, a number
  bytes[1] = 4;
  const auto newer = decodeBeginning(bytes);
  ASSERT_FALSE(newer);
  EXPECT_EQ(newer.error().exitCode, EX_PROTOCOL);
}

}  // namespace
}  // namespace tractiond::publish

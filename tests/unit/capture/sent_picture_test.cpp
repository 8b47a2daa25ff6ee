// What leaders and packets may say, and what is made of it; against the rules written a second time where they are
// drawn at random.
#include "daemon/capture/packet_survey.h"
#include "daemon/capture/sent_picture.h"
#include "daemon/capture/stream_filter.h"
#include "tests/support/seed.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace tractiond::capture::sent_picture_test {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::uint32_t kMono8 = 0x01080001, kRgb8 = 0x02180014;
const PictureShape kAgreed{640, 480, 307'200, kMono8};

TEST(SentPicture, AtRandomIsUsedIfAllOfItFits) {
  std::mt19937_64 random(test::seed());
  const auto one = [&](std::initializer_list<std::int64_t> of) { return *(of.begin() + random() % of.size()); };
  int fitting = 0;
  for (int i = 0; i < 100'000; ++i) {
    SentPicture sent;
    sent.payloadType = static_cast<int>(one({1, 1, 1, 1, 4, 5, 0, 2, 10, 0x8001, -1}));
    sent.width = static_cast<int>(one({640, 640, 640, 639, 0, -1}));
    sent.height = static_cast<int>(one({480, 480, 480, 481, 0x7fffffff}));
    sent.format = static_cast<std::uint32_t>(one({kMono8, kMono8, kMono8, kRgb8, 0}));
    sent.paddingX = static_cast<int>(one({0, 0, 1, 8, 65'535, -1}));
    sent.paddingY = static_cast<int>(one({0, 0, 3, 65'535, -1}));
    sent.size = static_cast<std::size_t>(one({307'199, 307'200, 307'203, 307'680, 311'040, 31'764'000, 100'000'000}));
    const std::size_t stride = 640 + static_cast<std::size_t>(sent.paddingX);
    const bool isPicture = sent.payloadType == 1 || sent.payloadType == 5;
    const bool fits = sent.paddingX >= 0 && sent.paddingY >= 0 &&
                      (isPicture ? sent.width == 640 && sent.height == 480 && sent.format == kMono8 &&
                                       sent.size >= stride * 480 + static_cast<std::size_t>(sent.paddingY)
                                 : sent.payloadType == 4 && sent.size == 307'200);
    const auto layout = layoutOf(sent, kAgreed);
    ASSERT_EQ(layout.has_value(), fits) << deviation(sent, kAgreed);
    ASSERT_EQ(deviation(sent, kAgreed).empty(), fits);
    if (!layout) continue;
    ++fitting;
    ASSERT_EQ(layout->stride, isPicture ? static_cast<int>(stride) : 640);
    ASSERT_LE(static_cast<std::size_t>(layout->stride) * 479 + 640, sent.size) << "a row that is not in the buffer";
  }
  EXPECT_GT(fitting, 1000);
}

// ---------------------------------------------------------------- packets

Bytes packet(std::uint8_t kind, std::uint16_t frame, std::uint32_t number, const Bytes& body) {
  Bytes bytes = {0,
                 0,
                 static_cast<std::uint8_t>(frame >> 8),
                 static_cast<std::uint8_t>(frame),
                 kind,
                 static_cast<std::uint8_t>(number >> 16),
                 static_cast<std::uint8_t>(number >> 8),
                 static_cast<std::uint8_t>(number)};
  bytes.insert(bytes.end(), body.begin(), body.end());
  return bytes;
}

Bytes leader() {
  Bytes body(36);
  body[3] = 1;
  body[12] = 1, body[13] = 8, body[15] = 1;  // Mono8
  body[18] = 2, body[19] = 128, body[22] = 1, body[23] = 224, body[27] = 4, body[31] = 6, body[33] = 8, body[35] = 9;
  return body;
}

TEST(PacketSurvey, ReadsALeaderAndTheLengthOfAFramesPackets) {
  PacketSurvey survey;
  survey.see(packet(3, 6, 5, Bytes(9000)), 7);  // of a frame whose leader did not come
  EXPECT_FALSE(survey.hasLeader());
  survey.see(packet(1, 7, 0, leader()), 2000);
  ASSERT_TRUE(survey.hasLeader());
  EXPECT_EQ(survey.port(), 2000);
  EXPECT_EQ(survey.picture().payloadType, 1);
  EXPECT_EQ(survey.picture().width, 640);
  EXPECT_EQ(survey.picture().height, 480);
  EXPECT_EQ(survey.picture().format, kMono8);
  EXPECT_EQ(survey.picture().x, 4);
  EXPECT_EQ(survey.picture().y, 6);
  EXPECT_EQ(survey.picture().paddingX, 8);
  EXPECT_EQ(survey.picture().paddingY, 9);
  survey.see(packet(3, 6, 6, Bytes(9000)), 2000);
  survey.see(packet(3, 7, 1, Bytes(8960)), 2000);
  EXPECT_EQ(survey.block_bytes(), 0U) << "it may be the last, and shorter";
  survey.see(packet(3, 7, 3, Bytes(2560)), 2000);
  EXPECT_EQ(survey.block_bytes(), 8960U);
  survey.see(packet(3, 7, 2, Bytes(8960)), 2000);  // sent again
  EXPECT_FALSE(survey.isOver());
  survey.see(packet(2, 7, 4, Bytes(8)), 2000);
  EXPECT_TRUE(survey.isOver());
}

// ---------------------------------------------------------------- sizes to ask for

TEST(PacketSizes, DivideWellAndAreAllowed) {
  EXPECT_EQ(evenPacketSize(9000, 36, 0, 4), 8996);
  EXPECT_EQ(evenPacketSize(1500, 36, 0, 4), 1444);
  EXPECT_EQ(evenPacketSize(576, 36, 0, 1), 548);
  EXPECT_EQ(evenPacketSize(9000, 48, 220, 4), 8944);
  EXPECT_EQ(evenPacketSize(9000, 36, 0, 8), 9000) << "no multiple of 8 does";
  EXPECT_EQ(evenPacketSize(9000, 36, 220, 8), 8996);
  EXPECT_EQ(evenPacketSize(100, 36, 100, 4), 100);
  for (int largest = 100; largest < 9000; largest += 7) {
    for (const int increment : {1, 2, 4, 6, 8, 16, 100}) {
      const int size = evenPacketSize(largest, 36, 92, increment);
      EXPECT_LE(size, largest);
      EXPECT_GE(size, 92);
      EXPECT_EQ((size - 92) % increment, 0);
    }
  }
}

}  // namespace
}  // namespace tractiond::capture::sent_picture_test

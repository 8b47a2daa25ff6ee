// What leaders may say, and what is made of it, against the rules written a second time; sizes of packets to ask for.
#include "daemon/capture/sent_picture.h"
#include "daemon/capture/stream_filter.h"
#include "tests/support/seed.h"

#include <gtest/gtest.h>

#include <random>

namespace tractiond::capture::sent_picture_test {
namespace {

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

TEST(PacketSizes, DivideWellAndAreAllowed) {
  EXPECT_EQ(evenPacketSize(9000, 36, 0, 4), 8996);
  EXPECT_EQ(evenPacketSize(9000, 48, 220, 4), 8944);
  EXPECT_EQ(evenPacketSize(9000, 36, 0, 8), 9000) << "no multiple of 8 does";
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

#include "daemon/records/snapshot.h"

#include <gtest/gtest.h>

#include <random>

namespace tractiond::snapshot_test {
namespace {

Frame frameOf(const std::vector<std::uint8_t>& bytes, int width, int height, PixelFormat format) {
  Frame frame;
  frame.data = bytes.data();
  frame.size = bytes.size();
  frame.width = width;
  frame.height = height;
  frame.format = format;
  frame.stride = traitsOf(format).stride(width);
  return frame;
}

using Levels = std::vector<std::uint8_t>;

TEST(PlainPicture, TakesTheChannelsInTheirOrder) {
  const Levels bytes = {1, 2, 3, 4, 5, 6};
  EXPECT_EQ(plainPicture(frameOf(bytes, 2, 1, PixelFormat::kRgb8)).levels, (Levels{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(plainPicture(frameOf(bytes, 2, 1, PixelFormat::kBgr8)).levels, (Levels{3, 2, 1, 6, 5, 4}));
  const PlainPicture grey = plainPicture(frameOf(bytes, 3, 2, PixelFormat::kMono8));
  EXPECT_EQ(grey.channels, 1);
  EXPECT_EQ(grey.levels, bytes);
}

TEST(PlainPicture, TakesTheHighBitsOfMore) {
  EXPECT_EQ(plainPicture(frameOf({0xF0, 0x0F, 0x10, 0x00}, 2, 1, PixelFormat::kMono12)).levels, (Levels{0xFF, 0x01}));
  // Samples 0xABC and 0x123: one stream of bits, low ones first; and GigE Vision's two samples in three bytes.
  EXPECT_EQ(plainPicture(frameOf({0xBC, 0x3A, 0x12}, 2, 1, PixelFormat::kMono12p)).levels, (Levels{0xAB, 0x12}));
  EXPECT_EQ(plainPicture(frameOf({0xAB, 0x3C, 0x12}, 2, 1, PixelFormat::kMono12Packed)).levels, (Levels{0xAB, 0x12}));
}

TEST(PlainPicture, TakesAMosaicsColoursFromEachCell) {
  const Levels bytes = {10, 20, 30, 40};  // two rows of two
  for (const auto& [format, colour] : {std::pair(PixelFormat::kBayerRG8, Levels{10, 25, 40}),
                                       {PixelFormat::kBayerBG8, Levels{40, 25, 10}},
                                       {PixelFormat::kBayerGR8, Levels{20, 25, 30}},
                                       {PixelFormat::kBayerGB8, Levels{30, 25, 20}}}) {
    const PlainPicture picture = plainPicture(frameOf(bytes, 2, 2, format));
    for (std::size_t pixel = 0; pixel < 4; ++pixel) {
      EXPECT_EQ(Levels(picture.levels.begin() + 3 * static_cast<std::ptrdiff_t>(pixel),
                       picture.levels.begin() + 3 * static_cast<std::ptrdiff_t>(pixel) + 3),
                colour);
    }
  }
}

TEST(PlainPicture, GreyIsGreyInYuv) {
  EXPECT_EQ(plainPicture(frameOf({77, 128, 99, 128}, 2, 1, PixelFormat::kYuv422_8)).levels,
            (Levels{77, 77, 77, 99, 99, 99}));
  EXPECT_EQ(plainPicture(frameOf({128, 77, 128, 99}, 2, 1, PixelFormat::kYuv422_8_UYVY)).levels,
            (Levels{77, 77, 77, 99, 99, 99}));
}

TEST(PlainPicture, EveryFormatStaysWithinItsBytes) {
  for (const PixelFormatTraits& traits : pixelFormats()) {
    const Levels bytes(traits.size(6, 4), 0xFF);
    const PlainPicture picture = plainPicture(frameOf(bytes, 6, 4, traits.format));
    EXPECT_EQ(picture.levels.size(), 6U * 4U * static_cast<unsigned>(picture.channels)) << traits.name;
    EXPECT_GE(picture.levels.back(), 0x70) << traits.name;
  }
}

/// Of random size, level for level; `seed` tells which.
struct RandomPicture {
  explicit RandomPicture(std::uint32_t seed)
      : chance(seed)
      , traits(pixelFormats()[chance() % pixelFormats().size()])
      , width(static_cast<int>(2 + chance() % 40))
      , height(static_cast<int>(2 + chance() % 40)) {
    if (traits.colours == PixelColours::kYuyv || traits.colours == PixelColours::kUyvy) width &= ~1;
    bytes.resize(traits.size(width, height));
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(chance());
  }
  Frame frame() const { return frameOf(bytes, width, height, traits.format); }

  std::mt19937 chance;
  const PixelFormatTraits& traits;
  int width, height;
  Levels bytes;
};

TEST(PlainPicture, ReducedIsTheMeanOfWholePixels) {
  for (std::uint32_t seed = 1; seed <= 500; ++seed) {
    RandomPicture random(seed);
    const Frame frame = random.frame();
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << random.traits.name << ' ' << random.width << " x "
                                    << random.height);
    const PlainPicture whole = plainPicture(frame);
    const int factor =
        1 + static_cast<int>(random.chance() % static_cast<unsigned>(std::min(random.width, random.height)));
    PlainPicture small;
    reduce(frame, factor, small);
    ASSERT_EQ(small.width, random.width / factor);
    ASSERT_EQ(small.height, random.height / factor);
    ASSERT_EQ(small.channels, whole.channels);
    Levels means;
    for (int y = 0; y < small.height; ++y) {
      for (int x = 0; x < small.width; ++x) {
        for (int c = 0; c < small.channels; ++c) {
          int sum = 0;
          for (int v = y * factor; v < (y + 1) * factor; ++v) {
            for (int u = x * factor; u < (x + 1) * factor; ++u) {
              sum += whole.levels[static_cast<std::size_t>((v * whole.width + u) * whole.channels + c)];
            }
          }
          means.push_back(static_cast<std::uint8_t>((sum + factor * factor / 2) / (factor * factor)));
        }
      }
    }
    ASSERT_EQ(small.levels, means);
  }
}

TEST(FrameCopy, IsWholeOrTellsWhatItNeeds) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    const RandomPicture random(seed);
    FrameCopy copy;
    copy.copyFrom(random.frame());
    EXPECT_FALSE(copy.fits);
    copy.makeRoom(copy.frame.size);
    copy.copyFrom(random.frame());
    ASSERT_TRUE(copy.fits);
    EXPECT_EQ(Levels(copy.frame.data, copy.frame.data + copy.frame.size), random.bytes);
    EXPECT_EQ(copy.frame.data, copy.bytes.data());
  }
}

}  // namespace
}  // namespace tractiond::snapshot_test

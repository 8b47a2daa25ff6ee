// What is read of a picture, against bytes written by hand from the standards. formats_test.cpp tracks markers in them.
#include "daemon/track/planes.h"
#include "daemon/track/unpack.h"
#include "tests/unit/track/scene.h"

#include <gtest/gtest.h>

#include <initializer_list>
#include <utility>
#include <vector>

namespace tractiond::track::planes_test {
namespace {

using sensor::Colour;
using sensor::MarkerLayer;

std::vector<std::uint16_t> unpacked(PixelPacking packing, int bits, const std::vector<std::uint8_t>& bytes,
                                    std::size_t count) {
  std::vector<std::uint16_t> samples(count);
  unpack(packing, bits, bytes.data(), count, samples.data());
  return samples;
}

Frame frameOf(const std::vector<std::uint8_t>& bytes, int width, int height, PixelFormat format) {
  Frame frame;
  frame.data = bytes.data();
  frame.size = bytes.size();
  frame.width = width;
  frame.height = height;
  frame.stride = traitsOf(format).stride(width);
  frame.format = format;
  return frame;
}

/// Of a sample's place [px].
double centreOf(float origin, float scale, int index) {
  return double{origin} + double{scale} * index;
}

using Samples = std::vector<std::uint16_t>;

// GenICam Pixel Format Naming Convention 2.4, 5.2 "lsb packed": the first sample fills the first byte and the low bits
// of the second one, whose high bits are the low ones of the second sample.
TEST(Unpack, StreamsAsTheNamingConventionSays) {
  EXPECT_EQ(unpacked(PixelPacking::kStream, 12, {0xBC, 0x3A, 0x12}, 2), (Samples{0xABC, 0x123}));
  EXPECT_EQ(unpacked(PixelPacking::kStream, 10, {0xFF, 0x03, 0x50, 0x95, 0xAA}, 4),
            (Samples{0x3FF, 0x000, 0x155, 0x2AA}));
  EXPECT_EQ(unpacked(PixelPacking::kStream, 14, {0xFF, 0x3F, 0x00, 0xA0, 0xAA, 0x56, 0x55}, 4),
            (Samples{0x3FFF, 0x0000, 0x2AAA, 0x1555}));
  // Fewer than a group: what lies in its last byte beyond is nobody's.
  EXPECT_EQ(unpacked(PixelPacking::kStream, 12, {0xBC, 0xFA}, 1), (Samples{0xABC}));
  EXPECT_EQ(unpacked(PixelPacking::kStream, 10, {0xFF, 0x03, 0xA0}, 2), (Samples{0x3FF, 0x000}));
}

// GigE Vision 2.2, Mono12Packed and Mono10Packed: byte 0 is bits 11 to 4 of the first pixel, the low nibble of byte 1
// its bits 3 to 0, the high nibble those of the second, byte 2 the second's bits 11 to 4. With 10 bits: 9 to 2, and
// bits 0, 1 and 4, 5 of byte 1.
TEST(Unpack, TriplesAsGigEVisionSays) {
  EXPECT_EQ(unpacked(PixelPacking::kTriple, 12, {0xAB, 0x3C, 0x12}, 2), (Samples{0xABC, 0x123}));
  EXPECT_EQ(unpacked(PixelPacking::kTriple, 10, {0xE9, 0x21, 0x56}, 2), (Samples{0x3A5, 0x15A}));
  EXPECT_EQ(unpacked(PixelPacking::kTriple, 12, {0xAB, 0x3C, 0x12, 0xDE, 0x0F}, 3), (Samples{0xABC, 0x123, 0xDEF}));
}

TEST(Planes, ReadLittleEndianSamplesOfWholeBytes) {
  const std::vector<std::uint8_t> bytes = {0xBC, 0x0A, 0x23, 0x01};
  const Frame frame = frameOf(bytes, 2, 1, PixelFormat::kMono12);
  const Plane plane = planeOf(frame, Colour::kGrey);
  EXPECT_EQ(plane.at(0, 0), 0xABC);
  EXPECT_EQ(plane.at(1, 0), 0x123);
}

// ITU-R BT.601 with full range; two pixels share U and V. Colours are held with an offset, in 1/16 levels.
TEST(Planes, ReadColoursOfLumaAndChroma) {
  constexpr int kWidth = 6, kHeight = 3;
  for (const PixelFormat format : {PixelFormat::kYuv422_8, PixelFormat::kYuv422_8_UYVY}) {
    std::vector<std::uint8_t> bytes;
    for (int pair = 0; pair < kWidth * kHeight / 2; ++pair) {
      const std::initializer_list<std::uint8_t> group = {40, 90, 200, 180};  // Y0 U Y1 V
      bytes.insert(bytes.end(), group);
      if (format == PixelFormat::kYuv422_8) continue;
      std::swap(bytes[bytes.size() - 4], bytes[bytes.size() - 3]);
      std::swap(bytes[bytes.size() - 2], bytes[bytes.size() - 1]);
    }
    const Frame frame = frameOf(bytes, kWidth, kHeight, format);
    for (const auto& [colour, off] :
         {std::pair(Colour::kGrey, 0.0), std::pair(Colour::kRed, 1.402 * 52.0),
          std::pair(Colour::kGreen, 0.344136 * 38.0 - 0.714136 * 52.0), std::pair(Colour::kBlue, -1.772 * 38.0)}) {
      MarkerLayer layer;
      layer.colour = colour;
      Planes planes({&layer, 1});
      planes.read(frame);
      const Plane& plane = planes.own(0);
      const double zero = colour == Colour::kGrey ? 0.0 : 256.0;
      EXPECT_NEAR(plane.at(2, 1) - zero, 40.0 + off, 0.6) << traitsOf(format).name << off;
      EXPECT_NEAR(plane.at(3, 1) - zero, 200.0 + off, 0.6) << traitsOf(format).name << off;
    }
  }
}

// A ramp has at each place its own value, whatever is interpolated: so the other colour is taken from the right places.
TEST(Planes, TheOtherColourIsTakenAtTheSamplesPlace) {
  for (const PixelFormat format : {PixelFormat::kBayerRG12, PixelFormat::kBayerGR12, PixelFormat::kBayerGB12,
                                   PixelFormat::kBayerBG12, PixelFormat::kRgb12, PixelFormat::kBgr12}) {
    const PixelFormatTraits& traits = traitsOf(format);
    constexpr int kWidth = 24, kHeight = 20;
    const int perPixel = traits.isBayer() ? 1 : 3;
    std::vector<std::uint16_t> samples;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        for (int k = 0; k < perPixel; ++k) samples.push_back(static_cast<std::uint16_t>(500 + 40 * x + 16 * y));
      }
    }
    Frame frame;
    frame.data = reinterpret_cast<const std::uint8_t*>(samples.data());
    frame.size = 2 * samples.size();
    frame.width = kWidth;
    frame.height = kHeight;
    frame.stride = traits.stride(kWidth);
    frame.format = format;
    for (const auto& [first, second] : {std::pair(Colour::kBlue, Colour::kRed), std::pair(Colour::kRed, Colour::kGreen),
                                        std::pair(Colour::kGreen, Colour::kBlue)}) {
      std::vector<MarkerLayer> layers(2);
      layers[0].colour = first;
      layers[1].colour = second;
      Planes planes(layers);
      planes.read(frame);
      EXPECT_TRUE(planes.mixes());
      for (std::size_t i = 0; i < 2; ++i) {
        const Plane& plane = planes.own(i);
        EXPECT_EQ(planes.other(i).first, planes.own(1 - i).first);
        for (int y = 1; y + 1 < plane.height; ++y) {
          for (int x = 1; x + 1 < plane.width; ++x) {
            const auto* p = reinterpret_cast<const std::uint16_t*>(plane.first + y * plane.stride) + x * plane.step;
            const double mean = 0.25 * (p[plane.other[0]] + p[plane.other[1]] + p[plane.other[2]] + p[plane.other[3]]);
            const double there =
                500.0 + 40.0 * centreOf(plane.u0, plane.scale, x) + 16.0 * centreOf(plane.v0, plane.scale, y);
            ASSERT_NEAR(plane.at(x, y), there, 0.01) << traits.name << x << ", " << y;
            ASSERT_NEAR(plane.gain * mean, there, 0.5) << traits.name << x << ", " << y;
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace tractiond::track::planes_test

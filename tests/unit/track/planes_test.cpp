// What is read of a picture, against bytes written by hand from the standards and against a packer that goes bit by
// bit.
#include "daemon/track/planes.h"
#include "daemon/track/unpack.h"
#include "tests/support/seed.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

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

/// A picture of random samples, row after row, of which the test keeps the numbers.
struct Random {
  Random(const PixelFormatTraits& traits, int w, int h, std::mt19937& generator)
      : format(traits)
      , width(w)
      , height(h) {
    const bool three = format.colours == PixelColours::kRgb || format.colours == PixelColours::kBgr;
    perPixel = three ? 3 : format.colours >= PixelColours::kYuyv ? 2 : 1;
    std::uniform_int_distribution<int> level(0, format.full());
    for (int i = 0; i < width * height * perPixel; ++i) samples.push_back(level(generator));
    bytes.assign(format.size(width, height), 0);
    const int bitsPerSample = format.bitsPerPixel / perPixel;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      for (int bit = 0; bit < format.bits; ++bit) {
        std::size_t place = i * static_cast<std::size_t>(bitsPerSample) + static_cast<std::size_t>(bit);
        if (format.packing == PixelPacking::kTriple) {
          const int low = format.bits - 8;
          const std::size_t byte = i / 2 * 3 + (bit < low ? 1 : i % 2 * 2);
          place = 8 * byte + static_cast<std::size_t>(bit < low ? bit + (i % 2 ? 4 : 0) : bit - low);
        }
        bytes[place / 8] = static_cast<std::uint8_t>(bytes[place / 8] | (samples[i] >> bit & 1) << place % 8);
      }
    }
    frame = frameOf(bytes, width, height, format.format);
  }

  double sample(int x, int y, int component = 0) const { return samples[(y * width + x) * perPixel + component]; }

  /// Of the light at a pixel; nothing where the pixel does not have it.
  std::optional<double> truth(Colour colour, int x, int y) const {
    const auto component = [&](int red) {
      return colour == Colour::kRed ? red : colour == Colour::kGreen ? 1 : 2 - red;
    };
    switch (format.colours) {
    case PixelColours::kMono:
      return sample(x, y);
    case PixelColours::kRgb:
    case PixelColours::kBgr:
      if (colour == Colour::kGrey) return (sample(x, y) + sample(x, y, 1) + sample(x, y, 2)) / 3.0;
      return sample(x, y, component(format.colours == PixelColours::kRgb ? 0 : 2));
    case PixelColours::kYuyv:
    case PixelColours::kUyvy: {
      const int luma = format.colours == PixelColours::kUyvy ? 1 : 0, pair = x / 2 * 2;
      const double light = sample(x, y, luma), u = sample(pair, y, 1 - luma) - 128.0;
      const double v = sample(pair + 1, y, 1 - luma) - 128.0;
      if (colour == Colour::kGrey) return light;
      return colour == Colour::kRed     ? light + 1.402 * v
             : colour == Colour::kGreen ? light - 0.344136 * u - 0.714136 * v
                                        : light + 1.772 * u;
    }
    default:
      break;
    }
    const std::string name(format.name);
    const char letter = name[5 + static_cast<std::size_t>(x % 2)];  // BayerRG: R and G, below G and B
    const char across = name[5 + static_cast<std::size_t>(1 - x % 2)];
    const char here = y % 2 == 0 ? letter : across == 'G' ? 'G' : across == 'R' ? 'B' : 'R';
    const char wanted = colour == Colour::kRed ? 'R' : colour == Colour::kBlue ? 'B' : 'G';
    if (colour != Colour::kGrey && here != wanted) return std::nullopt;
    return sample(x, y);
  }

  const PixelFormatTraits& format;
  int width, height, perPixel;
  std::vector<int> samples;
  std::vector<std::uint8_t> bytes;
  Frame frame;
};

TEST(Planes, GiveBackTheNumbersOfAnyFormat) {
  std::mt19937 generator(test::seed());
  std::uniform_int_distribution<int> size(3, 40);
  for (int trial = 0; trial < 150; ++trial) {
    const auto formats = pixelFormats();
    const PixelFormatTraits& format = formats[generator() % formats.size()];
    const bool pairs = format.isBayer() || format.colours >= PixelColours::kYuyv;
    const int width = pairs ? 2 * size(generator) : size(generator), height = size(generator);
    const Random picture(format, width, height, generator);
    MarkerLayer layer;
    layer.colour = static_cast<Colour>(generator() % 4);
    layer.darker = generator() % 2 != 0;
    Planes planes({&layer, 1});
    planes.read(picture.frame);
    const Plane& plane = planes.own(0);
    SCOPED_TRACE(std::string(format.name) + ", " + std::to_string(width) + " x " + std::to_string(height) +
                 ", colour " + std::to_string(static_cast<int>(layer.colour)));
    EXPECT_EQ(plane.sign, layer.darker ? -1.0F : 1.0F);
    EXPECT_NEAR(plane.unit, format.full() / 255.0, 1e-3);
    ASSERT_EQ(plane.width, static_cast<int>(width / double{plane.scale}));
    ASSERT_EQ(plane.height, static_cast<int>(height / double{plane.scale}));
    const bool made = plane.u0 == 0.5F;  // a mean of the two by two pixels
    const bool yuv = format.colours >= PixelColours::kYuyv && layer.colour != Colour::kGrey;
    for (int y = 0; y < plane.height; ++y) {
      for (int x = 0; x < plane.width; ++x) {
        double truth = 0.0;
        int count = 0;
        for (int dy = 0; dy <= (made ? 1 : 0); ++dy) {
          for (int dx = 0; dx <= (made ? 1 : 0); ++dx) {
            const auto one = picture.truth(layer.colour, static_cast<int>(centreOf(plane.u0, plane.scale, x)) + dx,
                                           static_cast<int>(centreOf(plane.v0, plane.scale, y)) + dy);
            if (!one) continue;
            truth += *one;
            ++count;
          }
        }
        ASSERT_GT(count, 0) << x << ", " << y;
        // Of YUV colours hold 1/16 level and an offset; means of 16 bits lose their last bits.
        const double step = yuv ? 0.6 : format.bits > 14 && plane.noise < 1.0F ? 2.0 : 0.01;
        ASSERT_NEAR(plane.at(x, y) - (yuv ? 256.0F : 0.0F), truth / count, step) << x << ", " << y;
      }
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

TEST(Planes, AGreyPictureHasNoOtherColour) {
  const std::vector<std::uint8_t> bytes(64 * 48);
  const Frame frame = frameOf(bytes, 64, 48, PixelFormat::kMono8);
  std::vector<MarkerLayer> layers(2);
  layers[1].colour = Colour::kRed;
  layers[1].darker = true;
  Planes planes(layers);
  planes.read(frame);
  EXPECT_FALSE(planes.mixes());
  EXPECT_EQ(planes.other(0).first, nullptr);
  EXPECT_EQ(planes.own(0).first, bytes.data());  // no copy
  EXPECT_EQ(planes.own(1).first, bytes.data());
}

}  // namespace
}  // namespace tractiond::track::planes_test

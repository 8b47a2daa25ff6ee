#include "daemon/records/snapshot.h"

#include <algorithm>
#include <array>

namespace tractiond {

namespace {

/// Reads samples one by one, by their number in the picture's stream: slow and for every format.
class Samples {
 public:
  explicit Samples(const Frame& frame)
      : traits_(traitsOf(frame.format))
      , frame_(frame)
      , perPixel_(traits_.colours == PixelColours::kRgb || traits_.colours == PixelColours::kBgr ? 3 : 1) {
    if (traits_.colours == PixelColours::kYuyv || traits_.colours == PixelColours::kUyvy) perPixel_ = 2;
    // Rows that begin in whole bytes may have more of them than they need.
    packed_ = traits_.stride(frame.width) == 0;
  }

  int perPixel() const { return perPixel_; }

  /// High 8 bits; 0 beyond the data.
  std::uint8_t at(int x, int y, int channel) const {
    const auto inRow = static_cast<std::size_t>(x * perPixel_ + channel);
    const std::size_t row = static_cast<std::size_t>(y);
    const std::size_t samplesBefore = packed_ ? row * static_cast<std::size_t>(frame_.width * perPixel_) : 0;
    const std::size_t bytesBefore = packed_ ? 0 : row * static_cast<std::size_t>(frame_.stride);
    return level(bytesBefore, samplesBefore + inRow);
  }

 private:
  std::uint32_t byte(std::size_t i) const { return i < frame_.size ? frame_.data[i] : 0U; }

  std::uint8_t level(std::size_t from, std::size_t sample) const {
    const int bits = traits_.bits;
    if (traits_.packing == PixelPacking::kTriple) {
      return static_cast<std::uint8_t>(byte(from + 3 * (sample / 2) + (sample % 2 == 0 ? 0 : 2)));
    }
    if (traits_.packing == PixelPacking::kStream) {
      const std::size_t bit = sample * static_cast<std::size_t>(bits);
      const std::uint32_t three =
          byte(from + bit / 8) | byte(from + bit / 8 + 1) << 8U | byte(from + bit / 8 + 2) << 16U;
      const std::uint32_t value = (three >> (bit % 8)) & static_cast<std::uint32_t>(traits_.full());
      return static_cast<std::uint8_t>(value >> static_cast<unsigned>(bits - 8));
    }
    if (bits == 8) return static_cast<std::uint8_t>(byte(from + sample));
    const std::uint32_t value = byte(from + 2 * sample) | byte(from + 2 * sample + 1) << 8U;
    return static_cast<std::uint8_t>(std::min(value >> static_cast<unsigned>(bits - 8), 255U));
  }

  const PixelFormatTraits& traits_;
  const Frame& frame_;
  int perPixel_;
  bool packed_ = false;
};

/// ITU-R BT.601, full range.
std::array<std::uint8_t, 3> fromYuv(int y, int u, int v) {
  const auto cut = [](double level) { return static_cast<std::uint8_t>(std::clamp(level, 0.0, 255.0)); };
  return {cut(y + 1.402 * (v - 128)), cut(y - 0.344136 * (u - 128) - 0.714136 * (v - 128)), cut(y + 1.772 * (u - 128))};
}

}  // namespace

PlainPicture plainPicture(const Frame& frame) {
  const PixelFormatTraits& traits = traitsOf(frame.format);
  const Samples samples(frame);
  PlainPicture picture;
  picture.width = frame.width;
  picture.height = frame.height;
  picture.channels = traits.colours == PixelColours::kMono ? 1 : 3;
  picture.levels.resize(static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height) *
                        static_cast<std::size_t>(picture.channels));
  std::uint8_t* to = picture.levels.data();
  // Place of red in the mosaic's cell; blue is diagonally across.
  const int redX = traits.colours == PixelColours::kBayerGR || traits.colours == PixelColours::kBayerBG ? 1 : 0;
  const int redY = traits.colours == PixelColours::kBayerGB || traits.colours == PixelColours::kBayerBG ? 1 : 0;
  for (int y = 0; y < frame.height; ++y) {
    for (int x = 0; x < frame.width; ++x) {
      if (traits.colours == PixelColours::kMono) {
        *to++ = samples.at(x, y, 0);
      } else if (traits.isBayer()) {
        const int left = std::min(x & ~1, frame.width - 2), top = std::min(y & ~1, frame.height - 2);
        *to++ = samples.at(left + redX, top + redY, 0);
        *to++ = static_cast<std::uint8_t>(
            (samples.at(left + 1 - redX, top + redY, 0) + samples.at(left + redX, top + 1 - redY, 0)) / 2);
        *to++ = samples.at(left + 1 - redX, top + 1 - redY, 0);
      } else if (samples.perPixel() == 3) {
        const bool bgr = traits.colours == PixelColours::kBgr;
        for (int channel = 0; channel < 3; ++channel) *to++ = samples.at(x, y, bgr ? 2 - channel : channel);
      } else {
        const bool lumaFirst = traits.colours == PixelColours::kYuyv;
        const int chroma = lumaFirst ? 1 : 0, pair = x & ~1;
        for (const std::uint8_t level : fromYuv(samples.at(x, y, 1 - chroma), samples.at(pair, y, chroma),
                                                samples.at(std::min(pair + 1, frame.width - 1), y, chroma))) {
          *to++ = level;
        }
      }
    }
  }
  return picture;
}

PlainPicture halved(const PlainPicture& picture) {
  PlainPicture half{picture.width / 2, picture.height / 2, picture.channels, {}};
  half.levels.reserve(picture.levels.size() / 4);
  const auto at = [&](int x, int y, int channel) {
    return static_cast<int>(
        picture.levels[static_cast<std::size_t>((y * picture.width + x) * picture.channels + channel)]);
  };
  for (int y = 0; y < half.height; ++y) {
    for (int x = 0; x < half.width; ++x) {
      for (int c = 0; c < half.channels; ++c) {
        const int sum =
            at(2 * x, 2 * y, c) + at(2 * x + 1, 2 * y, c) + at(2 * x, 2 * y + 1, c) + at(2 * x + 1, 2 * y + 1, c);
        half.levels.push_back(static_cast<std::uint8_t>((sum + 2) / 4));
      }
    }
  }
  return half;
}

}  // namespace tractiond

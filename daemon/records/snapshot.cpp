#include "daemon/records/snapshot.h"

#include <algorithm>
#include <array>
#include <cassert>

namespace tractiond {

namespace {

/// Reads single samples by their number in the picture's stream: slow, but for every format.
class Samples {
 public:
  explicit Samples(const Frame& frame)
      : traits_(traitsOf(frame.format))
      , frame_(frame)
      , perPixel_(traits_.colours == PixelColours::kRgb || traits_.colours == PixelColours::kBgr ? 3 : 1) {
    if (traits_.colours == PixelColours::kYuyv || traits_.colours == PixelColours::kUyvy) perPixel_ = 2;
    // Rows that begin in whole bytes may have padding.
    packed_ = traits_.stride(frame.width) == 0;
  }

  int perPixel() const { return perPixel_; }

  /// Returns the high 8 bits of a sample; 0 beyond the data.
  std::uint8_t at(int x, int y, int channel) const {
    const auto inRow = static_cast<std::size_t>(x * perPixel_ + channel);
    const auto row = static_cast<std::size_t>(y);
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

/// Converts YUV (ITU-R BT.601, full range) to RGB.
std::array<std::uint8_t, 3> fromYuv(int y, int u, int v) {
  const auto cut = [](double level) { return static_cast<std::uint8_t>(std::clamp(level, 0.0, 255.0)); };
  return {cut(y + 1.402 * (v - 128)), cut(y - 0.344136 * (u - 128) - 0.714136 * (v - 128)), cut(y + 1.772 * (u - 128))};
}

/// Computes the rows of the plain picture.
class PlainRows {
 public:
  explicit PlainRows(const Frame& frame)
      : frame_(frame)
      , traits_(traitsOf(frame.format))
      , samples_(frame)
      // Place of red in the mosaic's cell; blue is diagonally opposite.
      , redX_(traits_.colours == PixelColours::kBayerGR || traits_.colours == PixelColours::kBayerBG ? 1 : 0)
      , redY_(traits_.colours == PixelColours::kBayerGB || traits_.colours == PixelColours::kBayerBG ? 1 : 0) {}

  int channels() const { return traits_.colours == PixelColours::kMono ? 1 : 3; }

  /// Computes row y.
  /// \param to width x channels
  void read(int y, std::uint8_t* to) const {
    const std::uint8_t* const bytes = plainBytes(y);
    if (bytes && (traits_.colours == PixelColours::kMono || traits_.colours == PixelColours::kRgb)) {
      std::copy_n(bytes, frame_.width * channels(), to);
    } else if (bytes && traits_.isBayer() && y < (frame_.height & ~1) && frame_.width % 2 == 0) {
      readCells(y, to);
    } else {
      for (int x = 0; x < frame_.width; ++x) to = readPixel(x, y, to);
    }
  }

 private:
  /// Returns row y if its bytes can be used as they are; else null.
  const std::uint8_t* plainBytes(int y) const {
    if (traits_.packing != PixelPacking::kWhole || traits_.bits != 8 || frame_.stride == 0) return nullptr;
    const auto from = static_cast<std::size_t>(y) * static_cast<std::size_t>(frame_.stride);
    const auto count = static_cast<std::size_t>(frame_.width * samples_.perPixel());
    return from + count <= frame_.size ? frame_.data + from : nullptr;
  }

  /// Computes row y of a mosaic; two pixels are of one cell.
  void readCells(int y, std::uint8_t* to) const {
    const std::uint8_t* const top = plainBytes(y & ~1);
    const std::uint8_t* const bottom = plainBytes((y & ~1) + 1);
    if (!top || !bottom) {
      for (int x = 0; x < frame_.width; ++x) to = readPixel(x, y, to);
      return;
    }
    const std::uint8_t *const withRed = redY_ == 0 ? top : bottom, *const withBlue = redY_ == 0 ? bottom : top;
    for (int x = 0; x < frame_.width; x += 2, to += 6) {
      to[0] = to[3] = withRed[x + redX_];
      to[1] = to[4] = static_cast<std::uint8_t>((withRed[x + 1 - redX_] + withBlue[x + redX_]) / 2);
      to[2] = to[5] = withBlue[x + 1 - redX_];
    }
  }

  std::uint8_t* readPixel(int x, int y, std::uint8_t* to) const {
    if (traits_.colours == PixelColours::kMono) {
      *to++ = samples_.at(x, y, 0);
    } else if (traits_.isBayer()) {
      const int left = std::min(x & ~1, frame_.width - 2), top = std::min(y & ~1, frame_.height - 2);
      *to++ = samples_.at(left + redX_, top + redY_, 0);
      *to++ = static_cast<std::uint8_t>(
          (samples_.at(left + 1 - redX_, top + redY_, 0) + samples_.at(left + redX_, top + 1 - redY_, 0)) / 2);
      *to++ = samples_.at(left + 1 - redX_, top + 1 - redY_, 0);
    } else if (samples_.perPixel() == 3) {
      const bool bgr = traits_.colours == PixelColours::kBgr;
      for (int channel = 0; channel < 3; ++channel) *to++ = samples_.at(x, y, bgr ? 2 - channel : channel);
    } else {
      const bool lumaFirst = traits_.colours == PixelColours::kYuyv;
      const int chroma = lumaFirst ? 1 : 0, pair = x & ~1;
      for (const std::uint8_t level : fromYuv(samples_.at(x, y, 1 - chroma), samples_.at(pair, y, chroma),
                                              samples_.at(std::min(pair + 1, frame_.width - 1), y, chroma))) {
        *to++ = level;
      }
    }
    return to;
  }

  const Frame& frame_;
  const PixelFormatTraits& traits_;
  Samples samples_;
  int redX_, redY_;
};

/// Adds each run of `factor` pixels of a row to one sum.
template <int kChannels>
void addRuns(const std::uint8_t* row, int factor, std::vector<std::uint32_t>& sums) {
  for (std::size_t i = 0; i < sums.size(); i += kChannels) {
    for (int k = 0; k < factor; ++k) {
      for (std::size_t c = 0; c < kChannels; ++c) sums[i + c] += *row++;
    }
  }
}

}  // namespace

PlainPicture plainPicture(const Frame& frame) {
  PlainPicture picture;
  reduce(frame, 1, picture);
  return picture;
}

void reduce(const Frame& frame, int factor, PlainPicture& to) {
  assert(factor >= 1 && factor <= frame.width && factor <= frame.height);
  const PlainRows rows(frame);
  to.width = frame.width / factor;
  to.height = frame.height / factor;
  to.channels = rows.channels();
  std::vector<std::uint8_t> row(static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(to.channels));
  std::vector<std::uint32_t> sums(static_cast<std::size_t>(to.width) * static_cast<std::size_t>(to.channels));
  to.levels.resize(sums.size() * static_cast<std::size_t>(to.height));
  if (factor == 1) {
    for (int y = 0; y < to.height; ++y) rows.read(y, to.levels.data() + static_cast<std::size_t>(y) * row.size());
    return;
  }
  const std::uint32_t count = static_cast<std::uint32_t>(factor) * static_cast<std::uint32_t>(factor);
  auto level = to.levels.begin();
  for (int y = 0; y < to.height; ++y) {
    std::fill(sums.begin(), sums.end(), 0U);
    for (int k = 0; k < factor; ++k) {
      rows.read(y * factor + k, row.data());
      to.channels == 1 ? addRuns<1>(row.data(), factor, sums) : addRuns<3>(row.data(), factor, sums);
    }
    for (const std::uint32_t sum : sums) *level++ = static_cast<std::uint8_t>((sum + count / 2) / count);
  }
}

}  // namespace tractiond

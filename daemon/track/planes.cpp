#include "daemon/track/planes.h"

#include "base/vector_clones.h"
#include "daemon/track/unpack.h"

#include <algorithm>
#include <cassert>

namespace tractiond::track {

using sensor::Colour;

namespace {

/// YUV, full range (ITU-R BT.601): R = Y + 1.402 V', G = Y - 0.344 U' - 0.714 V', B = Y + 1.772 U'.
/// Samples have 16 units per level, above an offset that keeps them positive.
constexpr int kYuvUnits = 16, kYuvOffset = 256;

struct Place {
  int u, v;
};

/// Returns the place of red in the two by two pixels; blue is diagonally opposite.
Place redPlace(PixelColours colours) {
  return {colours == PixelColours::kBayerGR || colours == PixelColours::kBayerBG ? 1 : 0,
          colours == PixelColours::kBayerGB || colours == PixelColours::kBayerBG ? 1 : 0};
}

Place placeOf(PixelColours colours, Colour colour) {
  const Place red = redPlace(colours);
  return colour == Colour::kRed ? red : Place{1 - red.u, 1 - red.v};
}

bool isMosaic(PixelColours colours) {
  return colours >= PixelColours::kBayerRG && colours <= PixelColours::kBayerBG;
}

bool isRgb(PixelColours colours) {
  return colours == PixelColours::kRgb || colours == PixelColours::kBgr;
}

bool isYuv(PixelColours colours) {
  return colours == PixelColours::kYuyv || colours == PixelColours::kUyvy;
}

/// Returns the colour that also shows glare.
Colour glareColour(Colour own) {
  if (own == Colour::kGrey) return Colour::kGrey;
  return own == Colour::kRed ? Colour::kBlue : Colour::kRed;
}

/// Computes for each two by two pixels the sum of the two greens, and twice the other colour at their centre, from its
/// four nearest samples.
template <typename Sample>
void makeGreen(const std::uint8_t* first, std::ptrdiff_t stride, int width, int height, Place other, int shift,
               std::uint16_t* to) {
  const auto row = [&](int v) { return reinterpret_cast<const Sample*>(first + v * stride); };
  // Red and blue have equal, or different, parities of u and v; the greens have the others.
  const int green = other.u == other.v ? 1 : 0;
  const int columns = width / 2, rows = height / 2;
  const auto clampedRow = [&](int y) { return row(2 * std::clamp(y, 0, rows - 1) + other.v); };
  for (int y = 0; y < rows; ++y) {
    const Sample *top = row(2 * y), *bottom = row(2 * y + 1);
    const Sample *near = clampedRow(y), *far = clampedRow(other.v == 0 ? y + 1 : y - 1);
    for (int x = 0; x < columns; ++x, to += 2) {
      const int beside = 2 * std::clamp(other.u == 0 ? x + 1 : x - 1, 0, columns - 1) + other.u;
      const int at = 2 * x + other.u;
      to[0] = static_cast<std::uint16_t>((top[2 * x + green] + bottom[2 * x + 1 - green]) >> shift);
      to[1] =
          static_cast<std::uint16_t>((9 * near[at] + 3 * near[beside] + 3 * far[at] + far[beside] + 4) >> (3 + shift));
    }
  }
}

/// Computes the sum of all four pixels.
template <typename Sample>
void makeGreyOfMosaic(const std::uint8_t* first, std::ptrdiff_t stride, int width, int height, int shift,
                      std::uint16_t* to) {
  for (int y = 0; y < height / 2; ++y) {
    const auto* top = reinterpret_cast<const Sample*>(first + 2 * y * stride);
    const auto* bottom = reinterpret_cast<const Sample*>(first + (2 * y + 1) * stride);
    for (int x = 0; x < width / 2; ++x) {
      *to++ = static_cast<std::uint16_t>((top[2 * x] + top[2 * x + 1] + bottom[2 * x] + bottom[2 * x + 1]) >> shift);
    }
  }
}

/// Computes the sum of all three colours.
template <typename Sample>
void makeGreyOfRgb(const std::uint8_t* first, std::ptrdiff_t stride, int width, int height, int shift,
                   std::uint16_t* to) {
  for (int y = 0; y < height; ++y) {
    const auto* row = reinterpret_cast<const Sample*>(first + y * stride);
    for (int x = 0; x < width; ++x) {
      *to++ = static_cast<std::uint16_t>((row[3 * x] + row[3 * x + 1] + row[3 * x + 2]) >> shift);
    }
  }
}

std::uint16_t yuvSample(int colour256) {
  return static_cast<std::uint16_t>((colour256 + 256 * kYuvOffset) / (256 / kYuvUnits));
}

/// Computes red, green and blue of each pixel.
TRACTION_VECTOR_CLONES
void makeRgbOfYuv(const std::uint8_t* first, std::ptrdiff_t stride, int width, int height, int luma,
                  std::uint16_t* to) {
  const int chroma = 1 - luma;
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* row = first + y * stride;
    for (int x = 0; x < width; ++x, to += 3) {
      const int pair = x / 2 * 4, light = 256 * row[2 * x + luma];
      const int u = row[pair + chroma] - 128, v = row[pair + chroma + 2] - 128;
      to[0] = yuvSample(light + 359 * v);
      to[1] = yuvSample(light - 88 * u - 183 * v);
      to[2] = yuvSample(light + 454 * u);
    }
  }
}

}  // namespace

/// Samples in whole bytes, in the order in which the camera sends them.
struct Planes::Source {
  Plane all;  ///< of all samples, as if they were of one colour
  PixelColours colours = PixelColours::kMono;
  int bits = 8;

  std::ptrdiff_t samplesPerRow() const { return all.stride / (all.wide ? 2 : 1); }

  bool has(Colour colour) const {
    if (isMosaic(colours)) return colour == Colour::kRed || colour == Colour::kBlue;
    if (isRgb(colours)) return colour != Colour::kGrey;
    return colours == PixelColours::kMono || colour == Colour::kGrey;
  }

  /// Returns the plane of a colour that the source has.
  Plane plane(Colour colour) const {
    Plane made = all;
    std::ptrdiff_t from = 0;  // samples
    if (isMosaic(colours)) {
      const Place place = placeOf(colours, colour);
      from = place.v * samplesPerRow() + place.u;
      made.stride *= 2;
      made.step = 2;
      made.width /= 2;
      made.height /= 2;
      made.scale = 2.0F;
      made.u0 = static_cast<float>(place.u);
      made.v0 = static_cast<float>(place.v);
    } else if (isRgb(colours)) {
      from = indexOf(colour);
      made.step = 3;
    } else if (isYuv(colours)) {
      from = colours == PixelColours::kUyvy ? 1 : 0;
      made.step = 2;
    }
    made.first += (made.wide ? 2 : 1) * from;
    return made;
  }

  /// Returns the index of a colour in a pixel of RGB.
  int indexOf(Colour colour) const {
    if (colour == Colour::kGreen) return 1;
    return (colour == Colour::kRed) == (colours == PixelColours::kRgb) ? 0 : 2;
  }

  /// Sets in a plane of the source where the other colour lies, from a sample of `own`.
  void mix(Colour own, Colour other, Plane& plane) const {
    const std::ptrdiff_t row = samplesPerRow();
    if (isRgb(colours)) {
      plane.other.fill(indexOf(other) - indexOf(own));
    } else if (isMosaic(colours)) {
      plane.other = other == Colour::kGreen ? std::array<std::ptrdiff_t, 4>{-1, 1, -row, row}
                                            : std::array<std::ptrdiff_t, 4>{-row - 1, -row + 1, row - 1, row + 1};
      plane.otherNoise = 0.25F;
    }
  }
};

Planes::Planes(std::span<const sensor::MarkerLayer> layers) {
  for (const sensor::MarkerLayer& layer : layers) {
    layers_.push_back({layer.colour, glareColour(layer.colour), layer.darker});
  }
  const auto grey = [](const Layer& layer) { return layer.colour == Colour::kGrey; };
  coloursDiffer_ =
      layers_.size() == 2 && layers_[0].colour != layers_[1].colour && !grey(layers_[0]) && !grey(layers_[1]);
  if (coloursDiffer_) {
    layers_[0].otherColour = layers_[1].colour;
    layers_[1].otherColour = layers_[0].colour;
  }
}

Planes::Source Planes::sourceOf(const Frame& frame) {
  const PixelFormatTraits& format = traitsOf(frame.format);
  Source source{.all = {.first = frame.data,
                        .stride = frame.stride,
                        .step = 1,
                        .wide = format.bits > 8,
                        .width = frame.width,
                        .height = frame.height,
                        .unit = static_cast<float>(format.full()) / 255.0F},
                .colours = format.colours,
                .bits = format.bits};
  if (format.packing != PixelPacking::kWhole) {
    const std::size_t perRow = static_cast<std::size_t>(frame.width) * (isRgb(format.colours) ? 3U : 1U);
    const auto rows = static_cast<std::size_t>(frame.height);
    unpacked_.resize(perRow * rows);
    if (frame.stride == 0) {
      unpack(format.packing, format.bits, frame.data, perRow * rows, unpacked_.data());
    } else {
      for (std::size_t row = 0; row < rows; ++row) {
        unpack(format.packing, format.bits, frame.data + row * static_cast<std::size_t>(frame.stride), perRow,
               unpacked_.data() + row * perRow);
      }
    }
    source.all.first = reinterpret_cast<const std::uint8_t*>(unpacked_.data());
    source.all.stride = static_cast<std::ptrdiff_t>(2 * perRow);
  }
  const bool coloured =
      std::any_of(layers_.begin(), layers_.end(), [](const Layer& layer) { return layer.colour != Colour::kGrey; });
  if (isYuv(format.colours) && coloured) {
    unpacked_.resize(3 * static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height));
    makeRgbOfYuv(frame.data, frame.stride, frame.width, frame.height, format.colours == PixelColours::kUyvy ? 1 : 0,
                 unpacked_.data());
    source.all.first = reinterpret_cast<const std::uint8_t*>(unpacked_.data());
    source.all.stride = std::ptrdiff_t{6} * frame.width;
    source.all.wide = true;
    source.all.gain = 1.0F / kYuvUnits;
    source.colours = PixelColours::kRgb;
    source.bits = 14;
  }
  return source;
}

void Planes::read(const Frame& frame) {
  const Source source = sourceOf(frame);
  mixes_ = coloursDiffer_ && source.colours != PixelColours::kMono;
  for (Layer& layer : layers_) {
    const bool sameAsFirst = &layer != layers_.data() && layer.colour == layers_.front().colour;
    if (sameAsFirst) {
      layer.own = layers_.front().own;
    } else {
      makeOwn(source, layer);
    }
    layer.own.sign = layer.darker ? -1.0F : 1.0F;
  }
  for (Layer& layer : layers_) {
    layer.other = {};
    if (source.colours == PixelColours::kMono || layer.colour == Colour::kGrey) continue;
    layer.other = coloursDiffer_ ? layers_[&layer == layers_.data() ? 1 : 0].own : source.plane(layer.otherColour);
    layer.other.sign = layer.own.sign;
  }
}

void Planes::makeOwn(const Source& source, Layer& layer) {
  if (source.has(layer.colour)) {
    layer.own = source.plane(layer.colour);
    if (layer.colour != Colour::kGrey) source.mix(layer.colour, layer.otherColour, layer.own);
    return;
  }
  const bool mosaic = isMosaic(source.colours), pairs = layer.colour == Colour::kGreen;
  const Plane& all = source.all;
  const int width = all.width / (mosaic ? 2 : 1), height = all.height / (mosaic ? 2 : 1);
  const int summed = pairs ? 2 : mosaic ? 4 : 3;
  const int shift = source.bits <= 14 ? 0 : pairs ? 1 : 2;
  layer.made.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * (pairs ? 2U : 1U));
  const auto make = [&]<typename Sample>(Sample) {
    if (pairs) {
      makeGreen<Sample>(all.first, all.stride, all.width, all.height, placeOf(source.colours, layer.otherColour), shift,
                        layer.made.data());
    } else if (mosaic) {
      makeGreyOfMosaic<Sample>(all.first, all.stride, all.width, all.height, shift, layer.made.data());
    } else {
      makeGreyOfRgb<Sample>(all.first, all.stride, all.width, all.height, shift, layer.made.data());
    }
  };
  if (all.wide) {
    make(std::uint16_t{});
  } else {
    make(std::uint8_t{});
  }
  layer.own = {.first = reinterpret_cast<const std::uint8_t*>(layer.made.data()),
               .stride = std::ptrdiff_t{pairs ? 4 : 2} * width,
               .step = pairs ? 2 : 1,
               .wide = true,
               .width = width,
               .height = height,
               .gain = all.gain * static_cast<float>(1 << shift) / static_cast<float>(summed),
               .noise = 1.0F / static_cast<float>(summed),
               .unit = all.unit};
  if (mosaic) {
    layer.own.scale = 2.0F;
    layer.own.u0 = layer.own.v0 = 0.5F;
  }
  if (pairs) {
    layer.own.other.fill(1);
    layer.own.otherNoise =
        100.0F / 256.0F / layer.own.noise;  // variance of a mean with the weights 9, 3, 3, 1 sixteenths
  }
}

}  // namespace tractiond::track

// For each marker: copies its window of one colour's samples into a small array of floats, computes eight sums (I, I^2
// and the products with the six rows of weights of the nearest 1/8 sample), solves the triangular systems, and moves
// the centre. One step is nearly always enough, since the guess is right to some hundredths of a pixel. The loops run
// over lanes, so that each version of the function fills the vectors of its machine.
#include "daemon/track/centre.h"

#include "base/vector_clones.h"
#include "daemon/track/direct_fit.h"
#include "daemon/track/template_step.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <type_traits>

namespace tractiond::track {

namespace {

#define TRACTION_LAMBDA __attribute__((always_inline))

constexpr int kMaxSteps = 6;
constexpr std::size_t kAhead = 8;              // windows prefetched
constexpr int kSums = MarkerTemplate::kLanes;  // lanes that are summed separately
constexpr int kChunk = 8;                      // samples of a row that are copied at once
constexpr int kPhases = MarkerTemplate::kPhases;

/// The shape of the window, as compile-time numbers for the common shapes.
template <int kHalf>
struct Shape {
  static constexpr int half = kHalf;
  explicit Shape(const MarkerTemplate&) {}
};
template <>
struct Shape<0> {
  int half;
  TRACTION_INLINE explicit Shape(const MarkerTemplate& marker)
      : half(marker.half()) {}
};

/// Returns how many samples are read of each row of a window: its own, and some to the right of it.
constexpr int readOfRow(int half) {
  return (2 * half + kChunk - 1) / kChunk * kChunk;
}

/// Room for a window and for what is read to the right of its last row.
template <int kHalf>
using Window = float[MarkerTemplate::paddedSamples(kHalf > 0 ? kHalf : MarkerTemplate::kMaxHalf) + kChunk];

/// The range of centres whose windows lie within the picture [samples].
struct Range {
  float low, highX, highY;
};

template <typename S>
TRACTION_INLINE Range wholeWindow(const Plane& plane, S shape) {
  // One more sample to the right and below is reserved for reads that are wider than the window.
  return {static_cast<float>(shape.half), static_cast<float>(plane.width - readOfRow(shape.half) + shape.half - 3),
          static_cast<float>(plane.height - shape.half - 3)};
}

/// Rows of samples of one colour, `kStep` apart.
template <typename Sample, int kStep>
struct Rows {
  using Type = Sample;
  static constexpr int step = kStep;
  static constexpr bool isWide = sizeof(Sample) == 2;
};

template <typename R>
TRACTION_INLINE const typename R::Type* rowAt(const Plane& plane, int left, int top) {
  return reinterpret_cast<const typename R::Type*>(plane.first + top * plane.stride) + left * R::step;
}

template <typename R>
TRACTION_INLINE const typename R::Type* rowAfter(const Plane& plane, const typename R::Type* row) {
  return reinterpret_cast<const typename R::Type*>(reinterpret_cast<const std::uint8_t*>(row) + plane.stride);
}

/// Returns a sample of one colour. Of every other one, a pair is read as one number, whose low half it is: so the
/// compiler need not take them one by one.
template <typename R>
TRACTION_INLINE int sampleAt(const typename R::Type* row, int index) {
  if constexpr (R::step == 2) {
    using Pair [[gnu::may_alias, gnu::aligned(1)]] = std::conditional_t<R::isWide, std::uint32_t, std::uint16_t>;
    return static_cast<typename R::Type>(reinterpret_cast<const Pair*>(row)[index]);
  }
  return row[index * R::step];
}

/// Copies the rows of a window one after another by `copy`, which copies kChunk samples. What it reads to the right of
/// a row is overwritten by the next one, that of the last row by zeros.
template <typename R, typename S, typename Copy>
TRACTION_INLINE void copyRows(const Plane& plane, S shape, const typename R::Type* row, float* out, const Copy& copy) {
  const int width = 2 * shape.half, length = MarkerTemplate::rowLength(shape.half);
  for (int y = 0; y < width; ++y, row = rowAfter<R>(plane, row)) {
    for (int x = 0; x < length; x += kChunk) copy(row + x * R::step, out + y * length + x);
    if (width < length) {
      using Chunk = float __attribute__((vector_size(kChunk * sizeof(float))));
      Chunk samples;
      std::memcpy(&samples, out + y * length, sizeof samples);
      samples *= Chunk{1, 1, 1, 1, 1, 1};  // not the two behind a row of 6
      std::memcpy(out + y * length, &samples, sizeof samples);
    }
  }
  for (int i = width * length; i < MarkerTemplate::paddedSamples(shape.half); ++i) out[i] = 0.0F;
}

/// Returns four times the other colour at a sample.
template <typename R>
TRACTION_INLINE int otherAt(const Plane& plane, const typename R::Type* row, int index) {
  const auto beside = [&](int k) { return sampleAt<R>(row + plane.other[k], index); };
  return R::step == 2 ? beside(0) + beside(1) + beside(2) + beside(3) : 4 * beside(0);
}

/// Copies the window in levels, `kMixed` without the share of the other colour; less an offset, which it returns:
/// squares of large numbers would lose digits in a float.
template <bool kMixed, typename R, typename S>
TRACTION_INLINE float load(const Plane& plane, const CrossTalk& crossTalk, S shape, int left, int top, float* out) {
  const float share = kMixed ? 0.25F * crossTalk.other : 0.0F;
  const float gain = (R::isWide ? plane.gain : 1.0F) / (kMixed ? 1.0F - crossTalk.own * crossTalk.other : 1.0F);
  const auto* row = rowAt<R>(plane, left, top);
  const int base = R::isWide ? *row : 0, otherBase = R::isWide && kMixed ? otherAt<R>(plane, row, 0) : 0;
  copyRows<R>(plane, shape, row, out, [&](const auto* from, float* to) TRACTION_LAMBDA {
    for (int i = 0; i < kChunk; ++i) {
      const auto own = static_cast<float>(sampleAt<R>(from, i) - base);
      if constexpr (kMixed) {
        to[i] = gain * (own - share * static_cast<float>(otherAt<R>(plane, from, i) - otherBase));
      } else {
        to[i] = R::isWide ? gain * own : own;
      }
    }
  });
  return gain * (static_cast<float>(base) - share * static_cast<float>(otherBase));
}

/// Returns the variance of a sample without the other colour's share, relative to that of a plain sample.
TRACTION_INLINE float unmixedNoise(const Plane& plane, const CrossTalk& crossTalk) {
  const float gain = 1.0F / (1.0F - crossTalk.own * crossTalk.other);
  return gain * gain * (1.0F + plane.otherNoise * crossTalk.other * crossTalk.other);
}

struct Sums {
  float one, square;
  WindowProducts p;
};

/// Sums up the lanes of each of four rows. Vectors of 16 bytes are a register of every machine; left to itself, GCC
/// takes the lanes one by one.
TRACTION_INLINE void addLanes(const float (*lanes)[kSums], float* sum) {
  using Four = float __attribute__((vector_size(16)));
  Four rows[4];
  for (int k = 0; k < 4; ++k) {
    Four part[4];
    std::memcpy(part, lanes[k], sizeof part);
    rows[k] = (part[0] + part[2]) + (part[1] + part[3]);
  }
  const auto pairs = [](const Four& a, const Four& b, Four& to) {
    to = __builtin_shufflevector(a, b, 0, 2, 4, 6) + __builtin_shufflevector(a, b, 1, 3, 5, 7);
  };
  Four first, second, all;
  pairs(rows[0], rows[1], first);
  pairs(rows[2], rows[3], second);
  pairs(first, second, all);
  std::memcpy(sum, &all, sizeof all);
}

/// \param sign of the products with the weights, which are made for markers that are brighter than their surroundings
template <typename S>
TRACTION_INLINE Sums sums(S shape, const float* window, const float* weights, float sign) {
  const int samples = MarkerTemplate::paddedSamples(shape.half);
  alignas(64) float lanes[8][kSums];
  for (int i = 0; i < kSums; ++i) {
    float one = 0.0F, square = 0.0F, p[MarkerTemplate::kRows] = {};
    for (int k = 0; k < samples; k += kSums) {
      const float x = window[k + i];
      one += x;
      square += x * x;
#pragma GCC unroll 6
      for (int row = 0; row < MarkerTemplate::kRows; ++row) p[row] += x * weights[row * samples + k + i];
    }
    lanes[0][i] = one;
    lanes[1][i] = square;
#pragma GCC unroll 6
    for (int row = 0; row < MarkerTemplate::kRows; ++row) lanes[2 + row][i] = p[row];
  }
  float sum[8];
  addLanes(lanes, sum);
  addLanes(lanes + 4, sum + 4);
  return {sum[0], sum[1], {sign * sum[2], sign * sum[3], sign * sum[4], sign * sum[5], sign * sum[6], sign * sum[7]}};
}

template <typename R, int kHalf>
TRACTION_INLINE void fitOne(const Plane& plane, const MarkerTemplate& marker, const CrossTalk& crossTalk,
                            const Guess& guess, Centre& centre) {
  const Shape<kHalf> shape(marker);
  const float inverseScale = 1.0F / plane.scale;
  const float radius = static_cast<float>(marker.radius());
  const float settled = 0.5F / kPhases + 0.03F * radius;  // the neglected cubic term is then below 0.001 samples
  const float longest = 0.75F * radius;
  const auto [low, highX, highY] = wholeWindow(plane, shape);

  const float slopeU = plane.scale * guess.slopeU, slopeV = plane.scale * guess.slopeV;  // per sample
  float x = (guess.u - plane.u0) * inverseScale, y = (guess.v - plane.v0) * inverseScale;
  centre = {};
  alignas(64) Window<kHalf> window;
  for (int steps = 0; steps < kMaxSteps; ++steps) {
    if (!(x >= low && x <= highX && y >= low && y <= highY)) break;
    const int across = static_cast<int>(x * kPhases + 0.5F), down = static_cast<int>(y * kPhases + 0.5F);
    const int left = across / kPhases - shape.half + 1, top = down / kPhases - shape.half + 1;
    const float base = guess.mixed ? load<true, R>(plane, crossTalk, shape, left, top, window)
                                   : load<false, R>(plane, crossTalk, shape, left, top, window);
    const int index = down % kPhases * kPhases + across % kPhases;
    const Sums sum = sums(shape, window, marker.weights(index), plane.sign);
    const MarkerTemplate::Phase& phase = marker.phase(index);
    const TemplateStep step = stepOf(phase, sum.p, slopeU, slopeV, longest);
    centre.amplitude = step.amplitude;
    if (!(step.amplitude >= guess.minAmplitude)) break;
    x = static_cast<float>(across) / kPhases + step.du;
    y = static_cast<float>(down) / kPhases + step.dv;
    if (step.size <= settled) {
      const float used = static_cast<float>(marker.used());
      const float mean = sum.one / used;
      float rest = sum.square - sum.one * mean;
      for (const float p : sum.p) rest -= p * p;
      const float noise = plane.noise * (guess.mixed ? unmixedNoise(plane, crossTalk) : 1.0F);
      const float misfit = (rest > 0.0F ? rest : 0.0F) / ((used - 7.0F) * noise);
      describeFound(plane, phase, sum.p, noise, misfit, base + mean, centre);
      break;
    }
  }
  centre.u = plane.u0 + plane.scale * x;
  centre.v = plane.v0 + plane.scale * y;
}

/// Prefetches the rows of a window that will be read soon, as the hardware does not predict them.
template <typename R>
TRACTION_INLINE void prefetch(const Plane& plane, int half, const Guess& guess) {
  const float inverseScale = 1.0F / plane.scale;
  const float x = (guess.u - plane.u0) * inverseScale, y = (guess.v - plane.v0) * inverseScale;
  const auto low = static_cast<float>(half);
  if (!(x >= low && y >= low && x < static_cast<float>(plane.width - half) &&
        y < static_cast<float>(plane.height - half)))
    return;
  const int left = static_cast<int>(x) - half + 1, top = static_cast<int>(y) - half + 1;
  const auto* row = rowAt<R>(plane, left, top);
  for (int i = 0; i < 2 * half; ++i, row = rowAfter<R>(plane, row)) {
    __builtin_prefetch(row);
    __builtin_prefetch(row + 2 * half * R::step - 1);
  }
}

template <typename R>
TRACTION_INLINE void fitAll(const Plane& plane, const MarkerTemplate* markers, const CrossTalk& crossTalk,
                            const Guess* guesses, Centre* centres, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const MarkerTemplate& marker = markers[guesses[i].size];
    if (i + kAhead < count) prefetch<R>(plane, marker.half(), guesses[i + kAhead]);
    switch (marker.half()) {
    case 3:
      fitOne<R, 3>(plane, marker, crossTalk, guesses[i], centres[i]);
      break;
    case 4:
      fitOne<R, 4>(plane, marker, crossTalk, guesses[i], centres[i]);
      break;
    case 5:
      fitOne<R, 5>(plane, marker, crossTalk, guesses[i], centres[i]);
      break;
    case 6:
      fitOne<R, 6>(plane, marker, crossTalk, guesses[i], centres[i]);
      break;
    default:
      fitOne<R, 0>(plane, marker, crossTalk, guesses[i], centres[i]);
    }
  }
}

TRACTION_VECTOR_CLONES
void fit(const Plane& plane, const MarkerTemplate* markers, const CrossTalk& crossTalk, const Guess* guesses,
         Centre* centres, std::size_t count) {
  switch (plane.step + (plane.wide ? 3 : 0)) {
  case 1:
    return fitAll<Rows<std::uint8_t, 1>>(plane, markers, crossTalk, guesses, centres, count);
  case 2:
    return fitAll<Rows<std::uint8_t, 2>>(plane, markers, crossTalk, guesses, centres, count);
  case 3:
    return fitAll<Rows<std::uint8_t, 3>>(plane, markers, crossTalk, guesses, centres, count);
  case 4:
    return fitAll<Rows<std::uint16_t, 1>>(plane, markers, crossTalk, guesses, centres, count);
  case 5:
    return fitAll<Rows<std::uint16_t, 2>>(plane, markers, crossTalk, guesses, centres, count);
  default:
    return fitAll<Rows<std::uint16_t, 3>>(plane, markers, crossTalk, guesses, centres, count);
  }
}

}  // namespace

void fitCentres(const Plane& plane, std::span<const MarkerTemplate> markers, const CrossTalk& crossTalk,
                std::span<const Guess> guesses, std::span<Centre> centres) {
  assert(guesses.size() == centres.size() && (plane.step >= 1 && plane.step <= 3));
  assert(std::ranges::all_of(guesses, [&](const Guess& guess) { return guess.size < markers.size(); }));
  fit(plane, markers.data(), crossTalk, guesses.data(), centres.data(), guesses.size());
  for (std::size_t i = 0; i < guesses.size(); ++i) {
    if (centres[i].found) continue;
    const MarkerTemplate& marker = markers[guesses[i].size];
    const auto [low, highX, highY] = wholeWindow(plane, Shape<0>(marker));
    const float x = (centres[i].u - plane.u0) / plane.scale, y = (centres[i].v - plane.v0) / plane.scale;
    const bool isWhole = x >= low && x <= highX && y >= low && y <= highY;
    if (!isWhole) fitClippedCentre(plane, marker, crossTalk, guesses[i], centres[i]);
  }
}

float amplitudeAt(const Plane& plane, const MarkerTemplate& marker, float u, float v) {
  const float x = (u - plane.u0) / plane.scale, y = (v - plane.v0) / plane.scale;
  const int across = static_cast<int>(x * kPhases + 0.5F), down = static_cast<int>(y * kPhases + 0.5F);
  const int left = across / kPhases - marker.half() + 1, top = down / kPhases - marker.half() + 1;
  if (!(x >= 0.0F && y >= 0.0F) || left < 0 || top < 0 || left + readOfRow(marker.half()) >= plane.width ||
      top + 2 * marker.half() > plane.height) {
    return clippedAmplitudeAt(plane, marker, u, v);
  }
  const int width = 2 * marker.half();
  alignas(64) Window<0> window = {};
  const float base = plane.wide ? plane.at(left, top) : 0.0F;  // as load() does
  for (int i = 0; i < marker.used(); ++i) {
    window[i / width * MarkerTemplate::rowLength(marker.half()) + i % width] =
        plane.at(left + i % width, top + i / width) - base;
  }
  const int index = down % kPhases * kPhases + across % kPhases;
  const Sums sum = sums(Shape<0>(marker), window, marker.weights(index), plane.sign);
  return stepOf(marker.phase(index), sum.p, 0.0F, 0.0F, 1.0F).amplitude;
}

}  // namespace tractiond::track

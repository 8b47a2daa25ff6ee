// Both packings put four samples into at most seven bytes, whole bytes from group to group: one word is read for each
// group, and its samples are moved to their places with masks, in two groups at once.
#include "daemon/track/unpack.h"

#include <algorithm>
#include <cassert>
#include <cstring>

namespace tractiond::track {

namespace {

constexpr std::size_t kGroup = 4;                              // samples
using Words = std::uint64_t __attribute__((vector_size(16)));  // a register of every machine
constexpr std::uint64_t kEachHalf = 0x0000'0001'0000'0001, kEachQuarter = 0x0001'0001'0001'0001;

/// Applies `spread` to the words that begin every `stride` bytes, 2 * `pairs` of them.
template <typename Spread>
inline void unpackPairs(std::size_t stride, const std::uint8_t* from, std::size_t pairs, std::uint16_t* to,
                        const Spread& spread) {
  for (std::size_t i = 0; i < pairs; ++i, from += 2 * stride, to += 2 * kGroup) {
    std::uint64_t first = 0, second = 0;
    std::memcpy(&first, from, sizeof first);
    std::memcpy(&second, from + stride, sizeof second);
    Words words = {first, second};
    spread(words);
    std::memcpy(to, &words, sizeof words);
  }
}

void unpackStream(int bits, std::size_t stride, const std::uint8_t* from, std::size_t pairs, std::uint16_t* to) {
  const std::uint64_t two = (std::uint64_t{1} << 2 * bits) - 1, one = ((std::uint64_t{1} << bits) - 1) * kEachHalf;
  unpackPairs(stride, from, pairs, to, [=](Words& words) {
    words = (words & two) | (words << (32 - 2 * bits) & two << 32);
    words = (words & one) | (words << (16 - bits) & one << 16);
  });
}

/// The low bits of two samples lie in the middle byte of three; those of the second begin at bit 4.
void unpackTriples(int bits, std::size_t stride, const std::uint8_t* from, std::size_t pairs, std::uint16_t* to) {
  const int shared = bits - 8;
  const std::uint64_t low = ((std::uint64_t{1} << shared) - 1) * kEachHalf;
  unpackPairs(stride, from, pairs, to, [=](Words& words) {
    words = (words & 0xff'ffffU) | (words << 8 & 0xff'ffff'0000'0000U);
    words = (words & 0xff * kEachQuarter) << shared | (words >> 8 & low) | (words << 4 & low << 16);
  });
}

}  // namespace

void unpack(PixelPacking packing, int bits, const std::uint8_t* from, std::size_t count, std::uint16_t* to) {
  assert(packing != PixelPacking::kWhole && (bits == 10 || bits == 12 || bits == 14));
  const bool triple = packing == PixelPacking::kTriple;
  const auto unpackWords = triple ? unpackTriples : unpackStream;
  const std::size_t stride = triple ? 6 : static_cast<std::size_t>(bits) / 2;
  const std::size_t bytes = triple ? (3 * count + 1) / 2 : (static_cast<std::size_t>(bits) * count + 7) / 8;
  constexpr std::size_t kPair = 2 * kGroup, kMost = 16;
  // Two words of each pair are read, the second of which may end beyond its samples.
  const std::size_t whole = bytes < kMost ? 0 : (bytes - kMost) / (2 * stride) + 1;
  unpackWords(bits, stride, from, whole, to);
  for (std::size_t done = kPair * whole; done < count; done += kPair) {
    std::uint8_t words[kMost] = {};
    std::uint16_t samples[kPair];
    const std::size_t begin = done / kPair * 2 * stride;
    std::memcpy(words, from + begin, std::min(bytes - begin, sizeof words));
    unpackWords(bits, stride, words, 1, samples);
    std::memcpy(to + done, samples, std::min(kPair, count - done) * sizeof *to);
  }
}

}  // namespace tractiond::track

#include "daemon/track/unpack.h"

#include "base/vector_clones.h"

#include <cassert>

namespace tractiond::track {

namespace {

/// Returns any sample of a stream. Slow; for the last samples, which do not fill a group of bytes.
std::uint16_t sampleAt(const std::uint8_t* from, std::size_t index, int bits) {
  unsigned value = 0;
  for (int bit = 0; bit < bits; ++bit) {
    const std::size_t place = index * static_cast<std::size_t>(bits) + static_cast<std::size_t>(bit);
    value |= (from[place / 8] >> (place % 8) & 1U) << bit;
  }
  return static_cast<std::uint16_t>(value);
}

TRACTION_VECTOR_CLONES
void unpack10p(const std::uint8_t* from, std::size_t groups, std::uint16_t* to) {
  for (std::size_t i = 0; i < groups; ++i) {
    const std::uint8_t* b = from + 5 * i;
    to[4 * i] = static_cast<std::uint16_t>(b[0] | (b[1] & 0x03) << 8);
    to[4 * i + 1] = static_cast<std::uint16_t>(b[1] >> 2 | (b[2] & 0x0f) << 6);
    to[4 * i + 2] = static_cast<std::uint16_t>(b[2] >> 4 | (b[3] & 0x3f) << 4);
    to[4 * i + 3] = static_cast<std::uint16_t>(b[3] >> 6 | b[4] << 2);
  }
}

TRACTION_VECTOR_CLONES
void unpack12p(const std::uint8_t* from, std::size_t groups, std::uint16_t* to) {
  for (std::size_t i = 0; i < groups; ++i) {
    const std::uint8_t* b = from + 3 * i;
    to[2 * i] = static_cast<std::uint16_t>(b[0] | (b[1] & 0x0f) << 8);
    to[2 * i + 1] = static_cast<std::uint16_t>(b[1] >> 4 | b[2] << 4);
  }
}

TRACTION_VECTOR_CLONES
void unpack14p(const std::uint8_t* from, std::size_t groups, std::uint16_t* to) {
  for (std::size_t i = 0; i < groups; ++i) {
    const std::uint8_t* b = from + 7 * i;
    to[4 * i] = static_cast<std::uint16_t>(b[0] | (b[1] & 0x3f) << 8);
    to[4 * i + 1] = static_cast<std::uint16_t>(b[1] >> 6 | b[2] << 2 | (b[3] & 0x0f) << 10);
    to[4 * i + 2] = static_cast<std::uint16_t>(b[3] >> 4 | b[4] << 4 | (b[5] & 0x03) << 12);
    to[4 * i + 3] = static_cast<std::uint16_t>(b[5] >> 2 | b[6] << 6);
  }
}

/// \param shared number of low bits that lie in the middle byte; those of the second sample start at bit 4
TRACTION_VECTOR_CLONES
void unpackTriples(int shared, const std::uint8_t* from, std::size_t groups, std::uint16_t* to) {
  const int mask = (1 << shared) - 1;
  for (std::size_t i = 0; i < groups; ++i) {
    const std::uint8_t* b = from + 3 * i;
    to[2 * i] = static_cast<std::uint16_t>(b[0] << shared | (b[1] & mask));
    to[2 * i + 1] = static_cast<std::uint16_t>(b[2] << shared | (b[1] >> 4 & mask));
  }
}

}  // namespace

void unpack(PixelPacking packing, int bits, const std::uint8_t* from, std::size_t count, std::uint16_t* to) {
  assert(packing != PixelPacking::kWhole && bits > 8 && bits < 16);
  if (packing == PixelPacking::kTriple) {
    const int shared = bits - 8;
    unpackTriples(shared, from, count / 2, to);
    if (count % 2 != 0) {  // the low bits of the last sample are in the second of its two bytes
      const std::uint8_t* b = from + count / 2 * 3;
      to[count - 1] = static_cast<std::uint16_t>(b[0] << shared | (b[1] & ((1 << shared) - 1)));
    }
    return;
  }
  std::size_t done = 0;
  if (bits == 10) {
    done = count / 4 * 4;
    unpack10p(from, done / 4, to);
  } else if (bits == 12) {
    done = count / 2 * 2;
    unpack12p(from, done / 2, to);
  } else if (bits == 14) {
    done = count / 4 * 4;
    unpack14p(from, done / 4, to);
  }
  for (; done < count; ++done) to[done] = sampleAt(from, done, bits);
}

}  // namespace tractiond::track

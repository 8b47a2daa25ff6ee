#include "daemon/capture/chunk_reader.h"

#include <algorithm>
#include <bit>

namespace tractiond::capture {
namespace {

std::uint64_t unsignedOf(std::span<const std::uint8_t> bytes, bool bigEndian) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) value = value << 8 | bytes[bigEndian ? i : bytes.size() - 1 - i];
  return value;
}

double numberOf(const ChunkField& field, std::uint64_t raw) {
  if (field.isFloat)
    return field.length == 4 ? static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(raw)))
                             : std::bit_cast<double>(raw);
  if (!field.isSigned) return static_cast<double>(raw);
  const auto unused = static_cast<int>(64 - 8 * field.length);
  return static_cast<double>(static_cast<std::int64_t>(raw << unused) >> unused);
}

void enter(const ChunkField& field, std::uint64_t raw, Chunks& chunks) {
  const double value = numberOf(field, raw) * field.perUnit;
  switch (field.meaning) {
  case ChunkField::Meaning::kExposure_us:
    if (value > 0 && value < 1e9) chunks.extras.exposure_s = value * 1e-6;
    break;
  case ChunkField::Meaning::kGain:
    chunks.extras.gain = value;
    chunks.extras.hasGain = true;
    break;
  case ChunkField::Meaning::kLines:
    chunks.extras.lines = raw;
    chunks.extras.hasLines = true;
    break;
  case ChunkField::Meaning::kFrameId:
    chunks.frameId = raw;
    break;
  case ChunkField::Meaning::kTimestamp_ns:  // in a double it would lose its last digits
    if (field.perUnit == 1.0 && !field.isFloat)
      chunks.timestamp_ns = static_cast<std::int64_t>(raw);
    else if (value > -9e18 && value < 9e18)
      chunks.timestamp_ns = static_cast<std::int64_t>(value);
    break;
  }
}

}  // namespace

std::optional<std::size_t> readChunks(std::span<const std::uint8_t> buffer, std::size_t picture, bool bigEndian,
                                      std::span<const ChunkField> fields, Chunks& chunks) {
  constexpr std::size_t kTail = 8;  // id and length, four bytes each
  if (buffer.size() < picture) return std::nullopt;
  std::size_t end = buffer.size();
  while (end > picture) {
    if (end < kTail) return std::nullopt;
    const std::uint64_t id = unsignedOf(buffer.subspan(end - 8, 4), bigEndian);
    const std::uint64_t length = unsignedOf(buffer.subspan(end - 4, 4), bigEndian);
    if (length > end - kTail) return std::nullopt;
    const std::size_t begin = end - kTail - length;
    // The picture itself may be a chunk, the first.
    if (begin == 0) return length >= picture ? std::optional<std::size_t>(length) : std::nullopt;
    if (begin < picture) return std::nullopt;
    const auto data = buffer.subspan(begin, length);
    for (const ChunkField& field : fields)
      if (field.chunk == id && field.length > 0 && field.offset <= length && field.length <= length - field.offset)
        enter(field, unsignedOf(data.subspan(field.offset, field.length), field.bigEndian), chunks);
    end = begin;
  }
  return end;
}

}  // namespace tractiond::capture

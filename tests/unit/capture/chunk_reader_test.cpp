#include "daemon/capture/chunk_reader.h"
#include "tests/support/seed.h"

#include <gtest/gtest.h>

#include <bit>
#include <random>
#include <vector>

namespace tractiond::capture::chunk_reader_test {
namespace {

using Bytes = std::vector<std::uint8_t>;

void append(Bytes& bytes, std::uint64_t value, int size, bool bigEndian) {
  for (int i = 0; i < size; ++i)
    bytes.push_back(static_cast<std::uint8_t>(value >> (8 * (bigEndian ? size - 1 - i : i))));
}

void chunk(Bytes& buffer, std::uint32_t id, const Bytes& data, bool bigEndian) {
  buffer.insert(buffer.end(), data.begin(), data.end());
  append(buffer, id, 4, bigEndian);
  append(buffer, data.size(), 4, bigEndian);
}

/// Any number of chunks of any size: all are found, whatever else there is.
TEST(ChunkReader, ReadsAnyChunks) {
  std::mt19937_64 random(test::seed());
  for (int round = 0; round < 500; ++round) {
    const bool big = random() % 2 == 0;
    const std::size_t picture = 1 + random() % 4000;
    Bytes buffer(picture);
    if (random() % 2 == 0) chunk(buffer = {}, 1, Bytes(picture), big);
    const double exposure_us = static_cast<double>(1 + random() % 100'000);
    const std::uint64_t id = random() % (1ULL << 40);
    const auto noise = [&] { return Bytes(random() % 100, static_cast<std::uint8_t>(random())); };
    chunk(buffer, 77, noise(), big);
    Bytes data = noise();
    const std::size_t offset = data.size();
    const int width = random() % 2 == 0 ? 4 : 8;
    append(data,
           width == 8 ? std::bit_cast<std::uint64_t>(exposure_us)
                      : std::bit_cast<std::uint32_t>(static_cast<float>(exposure_us)),
           width, true);
    chunk(buffer, 50, data, big);
    chunk(buffer, 78, noise(), big);
    data.clear();
    append(data, id, 8, false);
    chunk(buffer, 51, data, big);
    const auto lines = static_cast<std::uint8_t>(random());
    chunk(buffer, 52, {lines}, big);
    const std::vector<ChunkField> fields{
        {ChunkField::Meaning::kExposure_us, 50, offset, static_cast<std::size_t>(width), true, false, true},
        {ChunkField::Meaning::kFrameId, 51, 0, 8, false, false, false},
        {ChunkField::Meaning::kLines, 52, 0, 1, false, false, true}};
    Chunks found;
    ASSERT_EQ(readChunks(buffer, picture, big, fields, found), picture);
    ASSERT_NEAR(found.extras.exposure_s, exposure_us * 1e-6, 1e-12);
    ASSERT_EQ(found.frameId, id);
    ASSERT_EQ(found.extras.lines, lines);
    ASSERT_TRUE(found.extras.hasLines && !found.extras.hasGain);
  }
}

}  // namespace
}  // namespace tractiond::capture::chunk_reader_test

#include "tests/support/seed.h"
#include "tests/unit/recording/foreign_recording.h"
#include "tests/unit/recording/random_recording.h"

#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <vector>

namespace recording::reader_test {
namespace {

/// Messages up to the end of each chunk.
std::vector<std::size_t> messagesUpTo(const std::string& bytes) {
  std::vector<std::size_t> sums;
  std::size_t sum = 0;
  for (const ChunkIndex& chunk : indexesOf(bytes)) {
    for (const auto& [channel, at] : chunk.indexOffsets) {
      std::size_t length = 0;
      for (int i = 3; i >= 0; --i) length = length << 8 | static_cast<unsigned char>(bytes[at + 11 + i]);
      sum += length / 16;
    }
    sums.push_back(sum);
  }
  return sums;
}

TEST(Reader, AllWholeChunksBeforeACutAreReadAndRecovered) {
  constexpr int kCuts = 1000;
  const RandomMessages messages(tractiond::test::seed());
  Memory memory;
  ASSERT_TRUE(messages.writeTo(memory));
  const auto chunks = chunksOf(memory.bytes);
  const auto sums = messagesUpTo(memory.bytes);
  ASSERT_EQ(sums.size(), chunks.size());
  ASSERT_EQ(sums.back(), messages.all.size());
  std::mt19937 random(tractiond::test::seed() + 1);
  std::size_t whole = 0;
  for (int i = 0; i < kCuts; ++i) {
    const std::string_view cut = std::string_view(memory.bytes).substr(0, 8 + random() % (memory.bytes.size() - 8));
    std::size_t count = 0;
    while (count < chunks.size() && chunks[count].second <= cut.size()) ++count;
    whole += count;
    const std::vector<Kept> expected(messages.all.begin(), messages.all.begin() + (count == 0 ? 0 : sums[count - 1]));
    const Read result = read(cut);
    ASSERT_TRUE(result.messages == expected) << cut.size();
    EXPECT_FALSE(result.extent.closed);
    EXPECT_NE(result.extent.trouble, "");
    const Read again = read(recovered(cut));
    ASSERT_TRUE(again.messages == expected) << cut.size();
    EXPECT_TRUE(again.extent.closed && again.extent.isWhole());
  }
  std::printf("%d cuts, %zu whole chunks before them, all read and recovered\n", kCuts, whole);
}

TEST(Reader, BeginsWhereItIsWanted) {
  const RandomMessages messages(tractiond::test::seed());
  Memory memory;
  ASSERT_TRUE(messages.writeTo(memory));
  std::mt19937 random(tractiond::test::seed() + 1);
  std::size_t passed = 0;
  for (int i = 0; i < 100; ++i) {
    const std::size_t first = random() % messages.all.size();
    const Read result = read(memory.bytes, std::get<2>(messages.all[first]));
    EXPECT_TRUE(result.extent.closed && result.extent.isWhole());
    ASSERT_LE(result.messages.size(), messages.all.size());
    const std::size_t before = messages.all.size() - result.messages.size();
    ASSERT_LE(before, first);
    ASSERT_TRUE(std::equal(result.messages.begin(), result.messages.end(), messages.all.begin() + before));
    passed += before;
  }
  EXPECT_GT(passed, 0U);
  // Without an end nothing tells what is declared where: all of it is read.
  const std::string_view cut = std::string_view(memory.bytes).substr(0, memory.bytes.size() - 10);
  EXPECT_EQ(read(cut, std::get<2>(messages.all.back())).messages.size(), messages.all.size());
}

TEST(Reader, ADamagedChunkIsPassedOver) {
  const RandomMessages messages(tractiond::test::seed());
  Memory memory;
  ASSERT_TRUE(messages.writeTo(memory));
  const auto chunks = chunksOf(memory.bytes);
  const auto sums = messagesUpTo(memory.bytes);
  std::mt19937 random(tractiond::test::seed() + 1);
  for (int i = 0; i < 200; ++i) {
    const std::size_t hit = random() % chunks.size();
    const std::size_t head = 9 + 8 + 8 + 8 + 4 + 4 + 8;  // up to its records
    std::string bytes = memory.bytes;
    char& damaged = bytes[chunks[hit].first + head + random() % (chunks[hit].second - chunks[hit].first - head)];
    damaged = static_cast<char>(damaged ^ 1 << random() % 8);
    std::vector<Kept> expected = messages.all;
    expected.erase(expected.begin() + (hit == 0 ? 0 : sums[hit - 1]), expected.begin() + sums[hit]);
    const Read result = read(bytes);
    EXPECT_TRUE(result.messages == expected);
    EXPECT_EQ(result.extent.badChunks, 1U);
    EXPECT_TRUE(result.extent.closed);
    EXPECT_FALSE(result.extent.isWhole());
    EXPECT_TRUE(read(recovered(bytes)).messages == expected);
  }
}

TEST(Reader, ChunksThatOtherProgramsCompressedAreRead) {
  const RandomMessages messages(tractiond::test::seed());
  Memory memory;
  ASSERT_TRUE(messages.writeTo(memory));
  for (Foreign how : {compressedBy("zstd", zstd), compressedBy("zstd", zstdFrames), compressedBy("lz4", lz4)}) {
    for (const bool hasSummary : {true, false}) {
      how.hasSummary = hasSummary;
      how.declaresInChunks = true;
      const std::string bytes = rewritten(memory.bytes, how);
      const Read result = read(bytes);
      EXPECT_TRUE(result.messages == messages.all);
      EXPECT_TRUE(result.extent.closed);
      EXPECT_EQ(result.extent.trouble, "");
      EXPECT_EQ(result.extent.messages, messages.all.size());
      EXPECT_TRUE(read(recovered(bytes)).messages == messages.all);
      const Read end = read(bytes, std::get<2>(messages.all.back()));
      EXPECT_EQ(end.messages.back(), messages.all.back());
      EXPECT_EQ(end.messages.size() < messages.all.size(), hasSummary);
    }
  }
}

TEST(Reader, SaysWhatIsNoRecording) {
  const auto failure = [](std::string_view bytes) {
    const fuzz::MemoryFile file(bytes);
    const auto reader = Reader::open(file.path());
    EXPECT_FALSE(reader);
    return reader ? Error{} : reader.error();
  };
  const auto expect = [](const Error& error, int exitCode, const std::string& what) {
    EXPECT_EQ(error.exitCode, exitCode);
    EXPECT_NE(error.what.find(what), std::string::npos) << error.message();
  };
  expect(failure(""), EX_DATAERR, "is empty");
  expect(failure("a letter to somebody"), EX_DATAERR, "is no recording");
  expect(failure("x"), EX_DATAERR, "is no recording");
  expect(failure(kMagic.substr(0, 5)), EX_DATAERR, "is cut off after 5 bytes");
  std::string newer(kMagic);
  newer[kVersionAt] = '1';
  expect(failure(newer + "of another kind"), EX_PROTOCOL, "newer version");
  expect(Reader::open("/nowhere").error(), EX_NOINPUT, "No such file");
  expect(Reader::open("/tmp").error(), EX_NOINPUT, "no file");
  const std::filesystem::path pipe =
      std::filesystem::temp_directory_path() / ("reader-test-" + std::to_string(getpid()) + ".mcap");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  expect(Reader::open(pipe).error(), EX_NOINPUT, "no file");
  std::filesystem::remove(pipe);
}

}  // namespace
}  // namespace recording::reader_test

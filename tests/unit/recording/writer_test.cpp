#include "recording/deltas.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/recording/random_recording.h"

#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <fstream>

namespace recording::writer_test {
namespace {

TEST(Writer, ItsIndexLeadsToEveryMessage) {
  const RandomMessages messages(tractiond::test::seed());
  Memory memory;
  ASSERT_TRUE(messages.writeTo(memory));
  const fuzz::MemoryFile file(memory.bytes);
  const auto summary = Reader::open(file.path())->summary();
  ASSERT_TRUE(summary && *summary);
  std::map<std::uint16_t, std::uint64_t> stated;
  forEachRecord(memory.bytes, [&](Opcode opcode, std::size_t /*begin*/, std::string_view content) {
    if (opcode != Opcode::kStatistics) return;
    Input in(content);
    EXPECT_EQ(in.number<std::uint64_t>(), messages.all.size());
    EXPECT_EQ(in.number<std::uint16_t>(), (*summary)->schemas.size());
    EXPECT_EQ(in.number<std::uint32_t>(), (*summary)->channels.size());
    in.bytes(3 * sizeof(std::uint32_t));  // attachments, metadata, chunks
    EXPECT_EQ(in.number<std::uint64_t>(), std::get<2>(messages.all.front()));
    EXPECT_EQ(in.number<std::uint64_t>(), std::get<2>(messages.all.back()));
    stated = takeCounts(in);
  });
  EXPECT_EQ((*summary)->schemas.at(1).data, std::string("\0\xff of any bytes", 15));
  EXPECT_EQ((*summary)->channels.at(1).metadata.at("sensor"), (*summary)->channels.at(1).topic);

  std::map<std::uint16_t, std::uint64_t> counts;
  const std::string_view bytes = memory.bytes;
  const auto number = [&](std::size_t at, int size) {
    std::uint64_t value = 0;
    for (int i = size - 1; i >= 0; --i) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
    return value;
  };
  const auto chunks = chunksOf(memory.bytes);
  const auto indexes = indexesOf(memory.bytes);
  ASSERT_EQ(indexes.size(), chunks.size());
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    const ChunkIndex& chunk = indexes[i];
    EXPECT_EQ(std::pair(chunk.offset, chunk.offset + chunk.length), chunks[i]);
    EXPECT_LT(chunk.end_ns - chunk.begin_ns, WriterOptions{}.chunkTime_ns);
    const std::size_t records = chunks[i].second - chunk.size;
    for (const auto& [channel, at] : chunk.indexOffsets) {
      ASSERT_EQ(number(at, 1),
                7U);  // a message index: opcode, length, channel, bytes of the array, time and offset ...
      ASSERT_EQ(number(at + 9, 2), channel);
      for (std::size_t entry = at + 15; entry < at + 15 + number(at + 11, 4); entry += 16) {
        const std::size_t message = records + number(entry + 8, 8);
        ASSERT_EQ(number(message, 1), 5U);
        EXPECT_EQ(number(message + 9, 2), channel);
        EXPECT_EQ(number(message + 15, 8), number(entry, 8));
        ++counts[channel];
      }
    }
  }
  EXPECT_EQ(counts, stated);
}

TEST(Writer, WhatADiskHasNoRoomForLeavesAllBeforeIt) {
  const RandomMessages messages(tractiond::test::seed());
  Memory enough;
  ASSERT_TRUE(messages.writeTo(enough));
  std::mt19937 random(tractiond::test::seed() + 1);
  int some = 0;
  for (int i = 0; i < 100; ++i) {
    constexpr std::size_t kEnd = 1 << 20;  // that is kept for the end
    Memory memory(kEnd + random() % (enough.bytes.size() / 2));
    EXPECT_FALSE(messages.writeTo(memory));
    if (memory.bytes.empty()) continue;  // not even for the end
    ++some;
    const Read result = read(memory.bytes);
    EXPECT_TRUE(result.extent.closed && result.extent.isWhole()) << result.extent.trouble;
    EXPECT_TRUE(std::equal(result.messages.begin(), result.messages.end(), messages.all.begin()));
  }
  EXPECT_GT(some, 50);
}

TEST(Writer, AnEmptyRecordingIsWhole) {
  Memory memory;
  ASSERT_TRUE(Writer(memory, {}).close());
  const Read result = read(memory.bytes);
  EXPECT_TRUE(result.extent.closed && result.extent.isWhole());
  EXPECT_TRUE(result.messages.empty());
}

class NewFiles : public testing::Test {
 protected:
  const tractiond::test::TemporaryFolder temporary_;
  const std::filesystem::path& folder_ = temporary_.path();
};

TEST_F(NewFiles, AreNotReadBeyondTheirEnd) {
  std::ofstream(folder_ / "old") << "0123456789";
  const auto file = OldFile::open(folder_ / "old");
  ASSERT_TRUE(file);
  std::string bytes;
  EXPECT_TRUE(file->read(2, 8, bytes));
  EXPECT_EQ(bytes, "23456789");
  for (const auto& [offset, count] :
       std::vector<std::pair<std::uint64_t, std::uint64_t>>{{2, 9}, {11, 0}, {0, UINT64_MAX}, {UINT64_MAX, 2}}) {
    EXPECT_FALSE(file->read(offset, count, bytes)) << offset << ", " << count;
    EXPECT_EQ(bytes, "");
  }
  std::filesystem::resize_file(folder_ / "old", 5);
  EXPECT_FALSE(file->read(0, 10, bytes));
  EXPECT_EQ(bytes, "");
}

TEST_F(NewFiles, NeverReplaceOne) {
  ASSERT_TRUE(NewFile::create(folder_ / "a")->append("kept", 0));
  const auto again = NewFile::create(folder_ / "a");
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().exitCode, EX_CANTCREAT);
  EXPECT_EQ(fuzz::fileText(folder_ / "a"), "kept");
  EXPECT_EQ(NewFile::create(folder_ / "nowhere" / "a").error().exitCode, EX_CANTCREAT);
}

TEST_F(NewFiles, TakeAllOrNothing) {
  auto file = NewFile::create(folder_ / "a");
  ASSERT_TRUE(file->append("kept", 0));
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small{100, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  const auto tooMuch = file->append(std::string(200, 'x'), 0);
  setrlimit(RLIMIT_FSIZE, &before);
  ASSERT_FALSE(tooMuch);
  EXPECT_EQ(tooMuch.error().exitCode, EX_IOERR);
  EXPECT_EQ(fuzz::fileText(folder_ / "a"), "kept");
  ASSERT_TRUE(file->append(" more", 0));
  EXPECT_EQ(fuzz::fileText(folder_ / "a"), "kept more");
}

}  // namespace
}  // namespace recording::writer_test

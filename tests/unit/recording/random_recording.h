// Recordings of random messages, in memory.
#pragma once

#include "recording/bytes.h"
#include "recording/reader.h"
#include "recording/writer.h"
#include "tests/fuzz/target.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

namespace recording {

/// A disk of some bytes.
class Memory : public Sink {
 public:
  explicit Memory(std::size_t room = SIZE_MAX)
      : room_(room) {}
  tl::expected<void, Error> append(std::string_view added, std::uint64_t reserve) override {
    if (added.size() + reserve > room_ - bytes.size()) return tl::unexpected(Error{EX_IOERR, "full"});
    bytes += added;
    return {};
  }
  tl::expected<void, Error> sync() override {
    synced = bytes.size();
    return {};
  }

  std::string bytes;
  std::size_t synced = 0;

 private:
  std::size_t room_;
};

/// Topic, sequence, log and publish time, data.
using Kept = std::tuple<std::string, std::uint32_t, std::uint64_t, std::uint64_t, std::string>;

/// Some thousand messages of some channels, most of some bytes, some of none, some of many.
class RandomMessages {
 public:
  explicit RandomMessages(unsigned seed)
      : random_(seed) {
    std::uint64_t time = 1'000'000'000'000'000'000 + random_();
    for (std::size_t i = 200 + random_() % 1000; i > 0; --i) {
      time += random_() % 30'000'000;
      const std::size_t length = random_() % 200 == 0 ? random_() % 200'000 : random_() % 300;
      std::string data(length, '\0');
      for (char& c : data) c = static_cast<char>(random_());
      all.emplace_back("topic/" + std::to_string(random_() % kChannels), random_(), time, random_(), data);
    }
  }

  /// As far as the sink takes them; whether it took them all.
  bool writeTo(Sink& sink) const {
    Writer writer(sink, {.chunkBytes = 1 << 16, .library = "a test"});
    const auto schema = writer.schema("a.Message", "protobuf", std::string("\0\xff of any bytes", 15));
    std::map<std::string, std::uint16_t> channels;
    bool isGood = true;
    for (const auto& [topic, sequence, log, publish, data] : all) {
      if (!channels.contains(topic)) {
        channels[topic] = writer.channel(topic == "topic/0" ? 0 : schema, topic, "protobuf", {{"sensor", topic}});
      }
      if (!writer.write({channels[topic], sequence, log, publish, data})) {
        isGood = false;
        break;
      }
    }
    return writer.close().has_value() && isGood;
  }

  std::vector<Kept> all;

 private:
  static constexpr int kChannels = 5;
  std::mt19937 random_;
};

struct Read {
  Extent extent;
  std::vector<Kept> messages;
};

inline Read read(std::string_view bytes, std::uint64_t since_ns = 0) {
  const fuzz::MemoryFile file(bytes);
  Read result;
  const auto reader = Reader::open(file.path());
  if (!reader) {
    result.extent.trouble = reader.error().message();
    return result;
  }
  const auto extent = reader->read(
      [&](const Channel& channel, const Schema*, const Message& message) {
        result.messages.emplace_back(channel.topic, message.sequence, message.logTime_ns, message.publishTime_ns,
                                     message.data);
      },
      since_ns);
  EXPECT_TRUE(extent);
  if (extent) result.extent = *extent;
  return result;
}

inline std::string recovered(std::string_view bytes) {
  const fuzz::MemoryFile file(bytes);
  Memory memory;
  const auto reader = Reader::open(file.path());
  EXPECT_TRUE(reader && recover(*reader, memory));
  return memory.bytes;
}

/// Calls use(opcode, begin, content) for each record outside of chunks. By no code of the reader's.
template <typename Use>
void forEachRecord(std::string_view bytes, const Use& use) {
  for (std::size_t at = 8; at + 9 <= bytes.size() - 8;) {
    Input head(bytes.substr(at, 9));
    const auto opcode = static_cast<Opcode>(head.number<std::uint8_t>());
    const auto length = head.number<std::uint64_t>();
    use(opcode, at, bytes.substr(at + 9, length));
    at += 9 + length;
  }
}

/// Of each chunk: where its record begins and ends.
inline std::vector<std::pair<std::size_t, std::size_t>> chunksOf(std::string_view bytes) {
  std::vector<std::pair<std::size_t, std::size_t>> chunks;
  forEachRecord(bytes, [&](Opcode opcode, std::size_t begin, std::string_view content) {
    if (opcode == Opcode::kChunk) chunks.emplace_back(begin, begin + 9 + content.size());
  });
  return chunks;
}

/// Takes a map of numbers.
inline std::map<std::uint16_t, std::uint64_t> takeCounts(Input& in) {
  std::map<std::uint16_t, std::uint64_t> counts;
  for (Input entries(in.text()); !entries.empty();) {
    const auto key = entries.number<std::uint16_t>();
    counts[key] = entries.number<std::uint64_t>();
  }
  return counts;
}

/// The summary's index of each chunk.
inline std::vector<ChunkIndex> indexesOf(std::string_view bytes) {
  std::vector<ChunkIndex> indexes;
  forEachRecord(bytes, [&](Opcode opcode, std::size_t /*begin*/, std::string_view content) {
    if (opcode != Opcode::kChunkIndex) return;
    Input in(content);
    ChunkIndex& index = indexes.emplace_back();
    for (auto* number : {&index.begin_ns, &index.end_ns, &index.offset, &index.length})
      *number = in.number<std::uint64_t>();
    index.indexOffsets = takeCounts(in);
    index.indexLength = in.number<std::uint64_t>();
    EXPECT_EQ(in.text(), "");
    index.size = in.number<std::uint64_t>();
  });
  return indexes;
}

}  // namespace recording

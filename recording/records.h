// The records of a recording: MCAP, version 0 (https://mcap.dev/spec), as far as they are written and read here. Each
// is an opcode, the length of its content in eight bytes, and its content.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace recording {

/// At both ends of a file; the sixth byte is the version.
inline constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
inline constexpr std::size_t kVersionAt = 5;

enum class Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0b,
  kSummaryOffset = 0x0e,
  kDataEnd = 0x0f,
};

inline constexpr std::size_t kRecordHead = 1 + 8;                     ///< opcode and length [bytes]
inline constexpr std::size_t kFooterBytes = kRecordHead + 8 + 8 + 4;  ///< the whole record

struct Schema {
  std::uint16_t id = 0;        ///< from 1
  std::string name, encoding;  ///< "traction.v1.Field", "protobuf"
  std::string data;            ///< of "protobuf": a FileDescriptorSet
};

struct Channel {
  std::uint16_t id = 0;
  std::uint16_t schema = 0;     ///< 0: none
  std::string topic, encoding;  ///< encoding of its messages: "protobuf", "json"
  std::map<std::string, std::string> metadata;
};

struct Message {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;        ///< as its sender counts; 0: it does not
  std::uint64_t logTime_ns = 0;      ///< when it was recorded [ns since 1970]
  std::uint64_t publishTime_ns = 0;  ///< when what it tells was so [ns since 1970]
  std::string_view data;
};

/// Messages that are written, checked and lost together.
struct Chunk {
  std::uint64_t begin_ns = 0, end_ns = 0;  ///< least and greatest log time
  std::uint64_t size = 0;                  ///< of its records, uncompressed
  std::uint32_t crc = 0;                   ///< of its records, uncompressed; 0: not told
  std::string_view compression;            ///< empty: none
  std::string_view records;
};

struct ChunkIndex {
  std::uint64_t begin_ns = 0, end_ns = 0;
  std::uint64_t offset = 0, length = 0;                 ///< of the chunk's record in the file
  std::map<std::uint16_t, std::uint64_t> indexOffsets;  ///< channel -> its message index behind the chunk
  std::uint64_t indexLength = 0;                        ///< of them all
  std::uint64_t size = 0;                               ///< of the chunk's records
};

struct Statistics {
  std::uint64_t messages = 0;
  std::uint16_t schemas = 0;
  std::uint32_t channels = 0, attachments = 0, metadata = 0, chunks = 0;
  std::uint64_t begin_ns = 0, end_ns = 0;         ///< least and greatest log time; 0: no messages
  std::map<std::uint16_t, std::uint64_t> counts;  ///< messages of each channel
};

struct Footer {
  std::uint64_t summary = 0, offsets = 0;  ///< where in the file they begin; 0: there are none
  std::uint32_t crc = 0;                   ///< from there up to this number; 0: not told
};

/// Log time and place in the chunk's records.
using IndexEntries = std::vector<std::pair<std::uint64_t, std::uint64_t>>;

// Whole records, added to the end of a string.
void putHeader(std::string& to, std::string_view library);
void put(std::string& to, const Schema& schema);
void put(std::string& to, const Channel& channel);
void put(std::string& to, const Message& message);
void put(std::string& to, const Chunk& chunk);
void putMessageIndex(std::string& to, std::uint16_t channel, const IndexEntries& entries);
void put(std::string& to, const ChunkIndex& index);
void put(std::string& to, const Statistics& statistics);
void putSummaryOffset(std::string& to, Opcode opcode, std::uint64_t start, std::uint64_t length);
void putDataEnd(std::string& to);
/// \param summary its crc goes on over the footer
void putFooter(std::string& to, std::uint64_t summaryStart, std::uint64_t offsetStart, std::string_view summary);

// Of contents from outside, without opcode and length; what is behind the last field known here is passed over. Empty:
// it is none.
std::optional<std::string> libraryOf(std::string_view header);
std::optional<Schema> schemaOf(std::string_view content);
std::optional<Channel> channelOf(std::string_view content);
std::optional<Message> messageOf(std::string_view content);
std::optional<Chunk> chunkOf(std::string_view content);
std::optional<ChunkIndex> chunkIndexOf(std::string_view content);
std::optional<Statistics> statisticsOf(std::string_view content);
std::optional<Footer> footerOf(std::string_view content);

/// CRC-32 as zlib has it. \param begin that of what stands before
std::uint32_t crcOf(std::string_view bytes, std::uint32_t begin = 0);

}  // namespace recording

// Records of a recording: MCAP, version 0 (https://mcap.dev/spec), as far as this project reads and writes it. A record
// is an opcode (1 byte), the length of its content (8 bytes) and its content.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace recording {

/// First and last bytes of a file; byte kVersionAt is the version.
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

/// Largest chunk that is written and read [bytes of its records, uncompressed]: a picture of 20 million pixels in RGB8
/// fits. A reader holds it in memory, twice if it is compressed, and a recording may be from anywhere.
inline constexpr std::uint64_t kLargestChunk = 64 << 20;

inline constexpr std::size_t kRecordHead = 1 + 8;                         ///< opcode and length [bytes]
inline constexpr std::size_t kMessageHead = kRecordHead + 2 + 4 + 8 + 8;  ///< a message's record without its data
inline constexpr std::size_t kFooterBytes = kRecordHead + 8 + 8 + 4;      ///< the whole record

/// Type of messages.
struct Schema {
  std::uint16_t id = 0;        ///< from 1; 0 means none
  std::string name, encoding;  ///< "traction.v1.Field", "protobuf"
  std::string data;            ///< for "protobuf": a FileDescriptorSet
};

/// Messages of one topic and type.
struct Channel {
  std::uint16_t id = 0;
  std::uint16_t schema = 0;     ///< id of the messages' schema; 0: none
  std::string topic, encoding;  ///< encoding of its messages: "protobuf", "json"
  std::map<std::string, std::string> metadata;
};

/// One message. Its data belong to the bytes that it was parsed from or is made for, which must outlive it.
struct Message {
  std::uint16_t channel = 0;         ///< id of its channel
  std::uint32_t sequence = 0;        ///< counted by the sender; 0: not counted
  std::uint64_t logTime_ns = 0;      ///< time of recording [ns since 1970]
  std::uint64_t publishTime_ns = 0;  ///< time that the message describes [ns since 1970]
  std::string_view data;
};

/// Group of messages that are written and checked together. Its views belong to the bytes that it was parsed from or is
/// made for, which must outlive it.
struct Chunk {
  std::uint64_t begin_ns = 0, end_ns = 0;  ///< smallest and largest log time of its messages [ns since 1970]
  std::uint64_t size = 0;                  ///< of `records`, uncompressed [bytes]
  std::uint32_t crc = 0;                   ///< CRC-32 of `records`, uncompressed; 0: not given
  std::string_view compression;            ///< empty: not compressed
  std::string_view records;                ///< message, schema and channel records one after another
};

/// States where a chunk is.
struct ChunkIndex {
  std::uint64_t begin_ns = 0, end_ns = 0;               ///< smallest and largest log time [ns since 1970]
  std::uint64_t offset = 0, length = 0;                 ///< of the chunk's record in the file [bytes]
  std::map<std::uint16_t, std::uint64_t> indexOffsets;  ///< channel -> offset of its message index in the file
  std::uint64_t indexLength = 0;                        ///< of all message indexes [bytes]
  std::uint64_t size = 0;                               ///< of the chunk's records, uncompressed [bytes]
};

struct Statistics {
  std::uint64_t messages = 0;
  std::uint16_t schemas = 0;
  std::uint32_t channels = 0, attachments = 0, metadata = 0, chunks = 0;  ///< number of records of each kind
  std::uint64_t begin_ns = 0, end_ns = 0;         ///< smallest and largest log time [ns since 1970]; 0: no messages
  std::map<std::uint16_t, std::uint64_t> counts;  ///< channel -> number of messages
};

struct Footer {
  std::uint64_t summary = 0, offsets = 0;  ///< offsets in the file of the summary and of its offset section; 0: none
  std::uint32_t crc = 0;  ///< CRC-32 of the bytes from the summary's begin up to this number; 0: not given
};

/// Per message: log time [ns since 1970], and offset of its record in the chunk's records [bytes].
using IndexEntries = std::vector<std::pair<std::uint64_t, std::uint64_t>>;

// These append a whole record, with opcode and length, to `to`. They check nothing. Texts must be shorter than 4 GiB.

/// Appends the first record of a file, which follows kMagic.
/// \param library name of the writing program
void putHeader(std::string& to, std::string_view library);
void put(std::string& to, const Schema& schema);
void put(std::string& to, const Channel& channel);
void put(std::string& to, const Message& message);
void put(std::string& to, const Chunk& chunk);
/// States where the messages of a channel lie in the chunk before.
/// \param entries by log time, ascending
void putMessageIndex(std::string& to, std::uint16_t channel, const IndexEntries& entries);
void put(std::string& to, const ChunkIndex& index);
void put(std::string& to, const Statistics& statistics);
/// States where a group of records of one kind lies in the summary.
/// \param opcode kind of the group's records
/// \param start offset of the group in the file [bytes]
/// \param length of the group [bytes]
void putSummaryOffset(std::string& to, Opcode opcode, std::uint64_t start, std::uint64_t length);
/// Ends the data section; states no CRC of it.
void putDataEnd(std::string& to);
/// Appends the last record of a file, which kMagic follows.
/// \param summaryStart, offsetStart offsets in the file of the summary and of its offset section; 0: none
/// \param summary bytes from the summary's begin to the footer, which the CRC covers
void putFooter(std::string& to, std::uint64_t summaryStart, std::uint64_t offsetStart, std::string_view summary);

// These parse a content (without opcode and length) from untrusted bytes. They ignore bytes after the last field known
// here, and return nothing if the content is too short. Messages and chunks refer to the content. CRCs are not checked.
std::optional<std::string> libraryOf(std::string_view header);  ///< Returns the writing program's name of a header.
std::optional<Schema> schemaOf(std::string_view content);
std::optional<Channel> channelOf(std::string_view content);
std::optional<Message> messageOf(std::string_view content);
std::optional<Chunk> chunkOf(std::string_view content);
std::optional<Footer> footerOf(std::string_view content);

/// Returns the CRC-32 of zlib.
/// \param begin CRC-32 of the bytes before, to continue it
std::uint32_t crcOf(std::string_view bytes, std::uint32_t begin = 0);

}  // namespace recording

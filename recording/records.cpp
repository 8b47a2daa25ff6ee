#include "recording/records.h"

#include "recording/bytes.h"

#include <zlib.h>

namespace recording {

namespace {

/// Appends a record.
/// \param fill writes the content to an Output
template <typename Fill>
void putRecord(std::string& to, Opcode opcode, const Fill& fill) {
  std::string content;
  Output inside(content);
  fill(inside);
  Output(to).number(static_cast<std::uint8_t>(opcode)).number(std::uint64_t{content.size()}).bytes(content);
}

/// Writes a map of numbers.
void putCounts(Output& out, const std::map<std::uint16_t, std::uint64_t>& counts) {
  out.number(static_cast<std::uint32_t>(counts.size() * (2 + 8)));
  for (const auto& [key, value] : counts) out.number(key).number(value);
}

template <typename Record>
std::optional<Record> ifWhole(const Input& in, Record record) {
  return in.ok() ? std::optional(std::move(record)) : std::nullopt;
}

}  // namespace

void putHeader(std::string& to, std::string_view library) {
  putRecord(to, Opcode::kHeader, [&](Output& out) { out.text("").text(library); });
}

void put(std::string& to, const Schema& schema) {
  putRecord(to, Opcode::kSchema,
            [&](Output& out) { out.number(schema.id).text(schema.name).text(schema.encoding).text(schema.data); });
}

void put(std::string& to, const Channel& channel) {
  putRecord(to, Opcode::kChannel, [&](Output& out) {
    std::string metadata;
    for (const auto& [key, value] : channel.metadata) Output(metadata).text(key).text(value);
    out.number(channel.id).number(channel.schema).text(channel.topic).text(channel.encoding).text(metadata);
  });
}

void put(std::string& to, const Message& message) {
  Output(to)
      .number(static_cast<std::uint8_t>(Opcode::kMessage))
      .number(std::uint64_t{kMessageHead - kRecordHead + message.data.size()})
      .number(message.channel)
      .number(message.sequence)
      .number(message.logTime_ns)
      .number(message.publishTime_ns)
      .bytes(message.data);
}

void put(std::string& to, const Chunk& chunk) {
  putRecord(to, Opcode::kChunk, [&](Output& out) {
    out.number(chunk.begin_ns).number(chunk.end_ns).number(chunk.size).number(chunk.crc).text(chunk.compression);
    out.number(std::uint64_t{chunk.records.size()}).bytes(chunk.records);
  });
}

void putMessageIndex(std::string& to, std::uint16_t channel, const IndexEntries& entries) {
  putRecord(to, Opcode::kMessageIndex, [&](Output& out) {
    out.number(channel).number(static_cast<std::uint32_t>(entries.size() * (8 + 8)));
    for (const auto& [time, offset] : entries) out.number(time).number(offset);
  });
}

void put(std::string& to, const ChunkIndex& index) {
  putRecord(to, Opcode::kChunkIndex, [&](Output& out) {
    out.number(index.begin_ns).number(index.end_ns).number(index.offset).number(index.length);
    putCounts(out, index.indexOffsets);
    out.number(index.indexLength).text("").number(index.size).number(index.size);
  });
}

void put(std::string& to, const Statistics& statistics) {
  putRecord(to, Opcode::kStatistics, [&](Output& out) {
    out.number(statistics.messages).number(statistics.schemas).number(statistics.channels);
    out.number(statistics.attachments).number(statistics.metadata).number(statistics.chunks);
    out.number(statistics.begin_ns).number(statistics.end_ns);
    putCounts(out, statistics.counts);
  });
}

void putSummaryOffset(std::string& to, Opcode opcode, std::uint64_t start, std::uint64_t length) {
  putRecord(to, Opcode::kSummaryOffset,
            [&](Output& out) { out.number(static_cast<std::uint8_t>(opcode)).number(start).number(length); });
}

void putDataEnd(std::string& to) {
  // No CRC of all data: each chunk has its own, and recover() could not continue it.
  putRecord(to, Opcode::kDataEnd, [](Output& out) { out.number(std::uint32_t{0}); });
}

void putFooter(std::string& to, std::uint64_t summaryStart, std::uint64_t offsetStart, std::string_view summary) {
  std::string record;
  putRecord(record, Opcode::kFooter,
            [&](Output& out) { out.number(summaryStart).number(offsetStart).number(std::uint32_t{0}); });
  record.resize(record.size() - 4);
  Output(record).number(crcOf(record, crcOf(summary)));
  to += record;
}

std::optional<std::string> libraryOf(std::string_view header) {
  Input in(header);
  in.text();  // the profile
  const std::string_view library = in.text();
  return ifWhole(in, std::string(library));
}

std::optional<Schema> schemaOf(std::string_view content) {
  Input in(content);
  Schema schema;
  schema.id = in.number<std::uint16_t>();
  schema.name = in.text();
  schema.encoding = in.text();
  schema.data = in.text();
  return ifWhole(in, std::move(schema));
}

std::optional<Channel> channelOf(std::string_view content) {
  Input in(content);
  Channel channel;
  channel.id = in.number<std::uint16_t>();
  channel.schema = in.number<std::uint16_t>();
  channel.topic = in.text();
  channel.encoding = in.text();
  Input metadata(in.text());
  while (!metadata.empty()) {
    const std::string_view key = metadata.text();
    channel.metadata[std::string(key)] = metadata.text();
  }
  if (!metadata.ok()) return std::nullopt;
  return ifWhole(in, std::move(channel));
}

std::optional<Message> messageOf(std::string_view content) {
  Input in(content);
  Message message;
  message.channel = in.number<std::uint16_t>();
  message.sequence = in.number<std::uint32_t>();
  message.logTime_ns = in.number<std::uint64_t>();
  message.publishTime_ns = in.number<std::uint64_t>();
  message.data = in.rest();
  return ifWhole(in, message);
}

std::optional<Chunk> chunkOf(std::string_view content) {
  Input in(content);
  Chunk chunk;
  chunk.begin_ns = in.number<std::uint64_t>();
  chunk.end_ns = in.number<std::uint64_t>();
  chunk.size = in.number<std::uint64_t>();
  chunk.crc = in.number<std::uint32_t>();
  chunk.compression = in.text();
  chunk.records = in.bytes(in.number<std::uint64_t>());
  return ifWhole(in, chunk);
}

std::optional<Footer> footerOf(std::string_view content) {
  Input in(content);
  Footer footer;
  footer.summary = in.number<std::uint64_t>();
  footer.offsets = in.number<std::uint64_t>();
  footer.crc = in.number<std::uint32_t>();
  return ifWhole(in, footer);
}

std::uint32_t crcOf(std::string_view bytes, std::uint32_t begin) {
  if (bytes.empty()) return begin;  // zlib would restart from its initial value
  return static_cast<std::uint32_t>(crc32_z(begin, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace recording

#include "recording/writer.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace recording {
namespace {

constexpr std::uint64_t kDeclared_bytes = 1 << 20;  ///< schemas and channels: more than a program's of this project
constexpr std::uint64_t kIndex_bytes = 128, kPerChannel_bytes = 2 + 8;

}  // namespace

Writer::Writer(Sink& sink, WriterOptions options)
    : sink_(sink)
    , options_(std::move(options))
    , pending_(kMagic) {
  putHeader(pending_, options_.library);
}

std::uint16_t Writer::schema(std::string_view name, std::string_view encoding, std::string_view data) {
  const auto id = static_cast<std::uint16_t>(schemas_.size() + 1);
  put(pending_, schemas_.emplace_back(Schema{id, std::string(name), std::string(encoding), std::string(data)}));
  return id;
}

std::uint16_t Writer::channel(std::uint16_t schema, std::string_view topic, std::string_view encoding,
                              std::map<std::string, std::string> metadata) {
  const auto id = static_cast<std::uint16_t>(channels_.size() + 1);
  put(pending_,
      channels_.emplace_back(Channel{id, schema, std::string(topic), std::string(encoding), std::move(metadata)}));
  return id;
}

std::optional<std::uint64_t> Writer::oldest_ns() const {
  return records_.empty() ? std::nullopt : std::optional(first_ns_);
}

bool Writer::isDue(std::uint64_t now_ns) const {
  // A recording that is recovered may state any times: the sum of two would be an earlier one.
  return !records_.empty() && now_ns >= first_ns_ && now_ns - first_ns_ >= options_.chunkTime_ns;
}

tl::expected<void, Error> Writer::write(const Message& message) {
  assert(message.channel != 0 && message.channel <= channels_.size() && "of a channel that was declared");
  const std::uint64_t size = kMessageHead + message.data.size();
  if (size > kLargestChunk) {
    return tl::unexpected(Error{EX_DATAERR, "a message has " + std::to_string(message.data.size()) +
                                                " bytes, more than a recording's chunk of at most " +
                                                std::to_string(kLargestChunk >> 20) + " MiB can hold"});
  }
  if (isDue(message.logTime_ns) || records_.size() >= options_.chunkBytes || records_.size() + size > kLargestChunk) {
    if (auto flushed = flush(); !flushed) return flushed;
  }
  const std::uint64_t time = message.logTime_ns;
  if (records_.empty()) first_ns_ = begin_ns_ = end_ns_ = time;
  begin_ns_ = std::min(begin_ns_, time);
  end_ns_ = std::max(end_ns_, time);
  entries_[message.channel].emplace_back(time, records_.size());
  put(records_, message);
  return {};
}

void Writer::addChunk(std::string& bytes, ChunkIndex& index) {
  index.begin_ns = begin_ns_;
  index.end_ns = end_ns_;
  index.offset = written_ + bytes.size();
  index.size = records_.size();
  put(bytes, Chunk{begin_ns_, end_ns_, records_.size(), crcOf(records_), "", records_});
  index.length = written_ + bytes.size() - index.offset;
  for (auto& [channel, entries] : entries_) {
    std::ranges::sort(entries);
    index.indexOffsets[channel] = written_ + bytes.size();
    putMessageIndex(bytes, channel, entries);
  }
  index.indexLength = written_ + bytes.size() - index.offset - index.length;
}

tl::expected<void, Error> Writer::flush() {
  std::string bytes = pending_;
  ChunkIndex index;
  const bool hasChunk = !records_.empty();
  if (hasChunk) addChunk(bytes, index);
  records_.clear();
  const auto entries = std::exchange(entries_, {});
  if (bytes.empty()) return {};
  // For the end: declarations, and the index of each chunk.
  const std::uint64_t reserve =
      kDeclared_bytes + (chunks_.size() + 1) * (kIndex_bytes + channels_.size() * kPerChannel_bytes);
  if (auto appended = sink_.append(bytes, reserve); !appended) return appended;
  written_ += bytes.size();
  pending_.clear();
  if (hasChunk) {
    statistics_.begin_ns = chunks_.empty() ? begin_ns_ : std::min(statistics_.begin_ns, begin_ns_);
    statistics_.end_ns = std::max(statistics_.end_ns, end_ns_);
    for (const auto& [channel, ofChannel] : entries) {
      statistics_.messages += ofChannel.size();
      statistics_.counts[channel] += ofChannel.size();
    }
    ++statistics_.chunks;
    chunks_.push_back(std::move(index));
  }
  return options_.syncChunks ? sink_.sync() : tl::expected<void, Error>();
}

tl::expected<void, Error> Writer::close() {
  if (closed_) return {};
  auto flushed = flush();
  statistics_.schemas = static_cast<std::uint16_t>(schemas_.size());
  statistics_.channels = static_cast<std::uint32_t>(channels_.size());
  std::string bytes = pending_, offsets;
  putDataEnd(bytes);
  const std::size_t begin = bytes.size();
  const auto group = [&](Opcode opcode, const auto& all) {
    const std::size_t start = bytes.size();
    for (const auto& one : all) put(bytes, one);
    if (bytes.size() != start) putSummaryOffset(offsets, opcode, written_ + start, bytes.size() - start);
  };
  group(Opcode::kSchema, schemas_);
  group(Opcode::kChannel, channels_);
  group(Opcode::kStatistics, std::vector{statistics_});
  group(Opcode::kChunkIndex, chunks_);
  const std::uint64_t offsetStart = written_ + bytes.size();
  bytes += offsets;
  putFooter(bytes, written_ + begin, offsetStart, std::string_view(bytes).substr(begin));
  bytes += kMagic;
  if (auto appended = sink_.append(bytes, 0); !appended) return appended;
  pending_.clear();
  closed_ = true;
  if (auto synced = sink_.sync(); !synced) return synced;
  return flushed;
}

}  // namespace recording

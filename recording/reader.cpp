#include "recording/reader.h"

#include "recording/bytes.h"
#include "recording/decompress.h"
#include "recording/writer.h"

#include <algorithm>
#include <utility>

namespace recording {

namespace {

/// Largest record that is read into memory: the largest chunk, its head, and what a compression may add to it.
constexpr std::uint64_t kLongest = kLargestChunk + (1 << 20);

/// Largest summary that is read into memory: that of some days.
constexpr std::uint64_t kLongestSummary = 1 << 28;

constexpr const char* kFull = "the recording declares more than 16 MiB of topics and schemas";

bool isDeclaration(Opcode opcode) {
  return opcode == Opcode::kSchema || opcode == Opcode::kChannel;
}

/// Parses and adds a schema or a channel. A second declaration of an id is ignored. Returns false if it is invalid, or
/// too much is declared.
bool add(Declared& to, Opcode opcode, std::string_view content) {
  to.isFull = to.isFull || to.bytes + content.size() > kMostDeclared;
  if (to.isFull) return false;
  if (opcode == Opcode::kSchema) {
    const auto schema = schemaOf(content);
    const bool isNew = schema && schema->id != 0 && to.schemas.try_emplace(schema->id, *schema).second;  // 0 means none
    to.bytes += isNew ? content.size() : 0;
    return schema.has_value();
  }
  const auto channel = channelOf(content);
  const bool isNew = channel && to.channels.try_emplace(channel->id, *channel).second;
  to.bytes += isNew ? content.size() : 0;
  return channel.has_value();
}

struct Head {
  Opcode opcode;
  std::uint64_t length;
};

Head headOf(std::string_view bytes) {
  Input in(bytes);
  const auto opcode = static_cast<Opcode>(in.number<std::uint8_t>());
  return {opcode, in.number<std::uint64_t>()};
}

std::string atByte(std::uint64_t offset) {
  return " at byte " + std::to_string(offset);
}

/// One pass over a recording.
class Scan {
 public:
  Scan(const Reader& reader, const Reader::Visit& visit, const std::stop_token& stop)
      : reader_(reader)
      , file_(reader.file())
      , visit_(visit)
      , stop_(stop) {}

  /// Reads the recording.
  /// \param since_ns skips chunks that end before, if the summary supplies what they declare
  tl::expected<Extent, Error> run(std::uint64_t since_ns) {
    if (since_ns > 0 && takeSummary()) since_ns_ = since_ns;
    if (failure_) return tl::unexpected(*failure_);
    for (extent_.whole_bytes = kMagic.size(); extent_.trouble.empty() && !extent_.closed && !stop_.stop_requested();) {
      if (auto taken = takeRecord(extent_.whole_bytes); !taken) return tl::unexpected(taken.error());
      if (failure_) return tl::unexpected(*failure_);
    }
    if (extent_.badChunks == 0) return std::move(extent_);
    extent_.trouble = (extent_.badChunks == 1 ? "1 chunk" : std::to_string(extent_.badChunks) + " chunks") +
                      " cannot be read, the first" + firstBad_ + (extent_.trouble.empty() ? "" : "; ") +
                      extent_.trouble;
    return std::move(extent_);
  }

 private:
  /// Reads the record at an offset.
  tl::expected<void, Error> takeRecord(std::uint64_t at) {
    const std::uint64_t left = file_.size() - at;
    if (left < kRecordHead) {
      extent_.trouble = "it was not closed: it ends" + atByte(file_.size()) +
                        (left == 0 ? std::string() : ", within the head of a record");
      return {};
    }
    if (auto got = file_.read(at, kRecordHead, bytes_); !got) return got;
    const Head head = headOf(bytes_);
    if (static_cast<int>(head.opcode) == 0) {
      extent_.trouble = "no record begins" + atByte(at);
      return {};
    }
    if (head.length > left - kRecordHead) {
      extent_.trouble = "it was not closed: it ends" + atByte(file_.size()) + ", within the record" + atByte(at);
      return {};
    }
    const auto isPassed = endsBefore(head.opcode, at + kRecordHead, head.length);
    if (!isPassed) return tl::unexpected(isPassed.error());
    if (isTaken(head.opcode) && !*isPassed) {
      if (head.length > kLongest && head.opcode == Opcode::kChunk) {
        skipChunk(at, tooLarge(head.length));
      } else if (head.length > kLongest) {
        extent_.trouble = "the record" + atByte(at) + " has " + std::to_string(head.length) + " bytes";
        return {};
      } else {
        if (auto got = file_.read(at + kRecordHead, head.length, bytes_); !got) return got;
        take(head.opcode, at);
        if (!extent_.trouble.empty()) return {};
      }
    }
    extent_.whole_bytes = at + kRecordHead + head.length;
    return head.opcode == Opcode::kFooter ? takeEnd() : tl::expected<void, Error>();
  }

  /// Returns whether the record is a chunk whose last log time is before since_ns_.
  tl::expected<bool, Error> endsBefore(Opcode opcode, std::uint64_t at, std::uint64_t length) {
    constexpr std::uint64_t kTimes = 2 * sizeof(std::uint64_t);  // smallest and largest
    if (since_ns_ == 0 || opcode != Opcode::kChunk || length < kTimes) return false;
    if (auto got = file_.read(at, kTimes, bytes_); !got) return tl::unexpected(got.error());
    Input in(bytes_);
    in.number<std::uint64_t>();
    return in.number<std::uint64_t>() < since_ns_;
  }

  static bool isTaken(Opcode opcode) {
    return isDeclaration(opcode) || opcode == Opcode::kHeader || opcode == Opcode::kMessage || opcode == Opcode::kChunk;
  }

  /// Interprets the record in bytes_ and visits its messages.
  void take(Opcode opcode, std::uint64_t at) {
    bool isGood = true;
    if (opcode == Opcode::kHeader) {
      const auto library = libraryOf(bytes_);
      isGood = library.has_value();
      extent_.library = library.value_or("");
    } else if (opcode == Opcode::kChunk) {
      takeChunk(at);
    } else if (opcode == Opcode::kMessage) {  // outside of a chunk, by other writers
      const auto message = messageOf(bytes_);
      isGood = message && isDeclared(message->channel);
      if (isGood) pass(*message);
    } else {
      isGood = add(declared_, opcode, bytes_);
    }
    if (!isGood) extent_.trouble = "the record" + atByte(at) + " is damaged";
    if (!isGood && declared_.isFull) extent_.trouble += std::string(", or ") + kFull;
  }

  /// Visits a message of a declared channel.
  void pass(const Message& message) {
    if (stop_.stop_requested()) return;
    ++extent_.messages;
    const Channel& channel = declared_.channels.at(message.channel);
    auto schema = declared_.schemas.find(channel.schema);
    if (schema == declared_.schemas.end() && channel.schema != 0 && takeSummary()) {
      schema = declared_.schemas.find(channel.schema);
    }
    visit_(channel, schema == declared_.schemas.end() ? nullptr : &schema->second, message);
  }

  /// Visits the messages of the chunk in bytes_, all of them or none.
  void takeChunk(std::uint64_t at) {
    const auto chunk = chunkOf(bytes_);
    if (!chunk) return skipChunk(at, "it is damaged");
    if (chunk->size > kLargestChunk || chunk->records.size() > kLongest) return skipChunk(at, tooLarge(chunk->size));
    std::string_view records = chunk->records;
    if (!chunk->compression.empty()) {
      if (const auto done = decompress(chunk->compression, records, chunk->size, unpacked_); !done) {
        return skipChunk(at, done.error());
      }
      records = unpacked_;
    }
    if (records.size() != chunk->size || (chunk->crc != 0 && crcOf(records) != chunk->crc) || !isWhole(records)) {
      return skipChunk(at, declared_.isFull ? kFull : "it is damaged");
    }
    ++extent_.chunks;
    each(records, [this](Opcode opcode, std::string_view content) {
      if (opcode == Opcode::kMessage) pass(*messageOf(content));
      return true;
    });
  }

  /// Returns whether all records of a chunk can be interpreted, and adds their declarations.
  bool isWhole(std::string_view records) {
    return each(records, [this](Opcode opcode, std::string_view content) {
      if (isDeclaration(opcode)) return add(declared_, opcode, content);
      if (opcode != Opcode::kMessage) return true;
      const auto message = messageOf(content);
      return message && isDeclared(message->channel);
    });
  }

  /// Calls `use` with opcode and content of each record until it returns false. Returns whether all were used.
  template <typename Use>
  static bool each(std::string_view records, const Use& use) {
    for (Input in(records); !in.empty();) {
      const Head head = headOf(in.bytes(kRecordHead));
      const std::string_view content = in.bytes(head.length);
      if (!in.ok() || !use(head.opcode, content)) return false;
    }
    return true;
  }

  void skipChunk(std::uint64_t at, const std::string& why) {
    if (extent_.badChunks++ == 0) firstBad_ = atByte(at) + ": " + why;
  }

  static std::string tooLarge(std::uint64_t size) {
    return "it has " + std::to_string(size) + " bytes, and chunks of up to " + std::to_string(kLargestChunk >> 20) +
           " MiB are read";
  }

  bool isDeclared(std::uint16_t channel) {
    return declared_.channels.contains(channel) || (takeSummary() && declared_.channels.contains(channel));
  }

  /// Adds the declarations of the summary, once: those of damaged or skipped chunks are missing otherwise. Returns
  /// whether there is a summary.
  bool takeSummary() {
    if (hasSummary_) return *hasSummary_;
    auto summary = reader_.summary();
    if (!summary) failure_ = summary.error();
    hasSummary_ = summary && *summary;
    if (*hasSummary_) {
      declared_.schemas.merge((*summary)->schemas);
      declared_.channels.merge((*summary)->channels);
    }
    return *hasSummary_;
  }

  tl::expected<void, Error> takeEnd() {
    const std::uint64_t left = file_.size() - extent_.whole_bytes;
    if (left < kMagic.size()) {
      extent_.trouble = "it was not closed: its last bytes are missing";
      return {};
    }
    if (auto got = file_.read(extent_.whole_bytes, kMagic.size(), bytes_); !got) return got;
    if (bytes_ != kMagic || left != kMagic.size()) {
      extent_.trouble = "there is more behind its end" + atByte(extent_.whole_bytes);
      return {};
    }
    extent_.whole_bytes += kMagic.size();
    extent_.closed = true;
    return {};
  }

  const Reader& reader_;
  const OldFile& file_;
  const Reader::Visit& visit_;
  const std::stop_token& stop_;
  std::uint64_t since_ns_ = 0;
  Extent extent_;
  std::string firstBad_;
  Declared declared_;
  std::optional<bool> hasSummary_;  ///< nothing: not looked for yet
  std::optional<Error> failure_;    ///< of reading the summary
  std::string bytes_;
  std::string unpacked_;  ///< records of the chunk in bytes_, if they are compressed
};

}  // namespace

tl::expected<Reader, Error> Reader::open(const std::filesystem::path& path) {
  auto file = OldFile::open(path);
  if (!file) return tl::unexpected(file.error());
  if (file->size() == 0) return tl::unexpected(Error{EX_DATAERR, "is empty: nothing was recorded", path});
  std::string magic;
  if (auto got = file->read(0, std::min<std::uint64_t>(kMagic.size(), file->size()), magic); !got) {
    return tl::unexpected(got.error());
  }
  if (magic.size() < kMagic.size() && kMagic.substr(0, magic.size()) == magic) {
    return tl::unexpected(Error{EX_DATAERR, "is cut off after " + std::to_string(magic.size()) + " bytes", path});
  }
  std::string ours = magic;
  if (ours.size() > kVersionAt) ours[kVersionAt] = kMagic[kVersionAt];
  if (ours != kMagic) return tl::unexpected(Error{EX_DATAERR, "is no recording (MCAP)", path});
  if (ours != magic) {
    return tl::unexpected(Error{EX_PROTOCOL, "is of a newer version of MCAP than 0, the one that is read here", path,
                                "read it with a newer tractionctl"});
  }
  return Reader(*std::move(file));
}

tl::expected<Extent, Error> Reader::read(const Visit& visit, std::uint64_t since_ns,
                                         const std::stop_token& stop) const {
  return Scan(*this, visit, stop).run(since_ns);
}

tl::expected<std::optional<Declared>, Error> Reader::summary() const {
  const std::uint64_t end = file_.size();
  std::string bytes;
  if (end < kMagic.size() + kFooterBytes + kMagic.size()) return std::nullopt;
  const std::uint64_t footerAt = end - kMagic.size() - kFooterBytes;
  if (auto got = file_.read(footerAt, end - footerAt, bytes); !got) return tl::unexpected(got.error());
  const auto footer = footerOf(std::string_view(bytes).substr(kRecordHead));
  if (!bytes.ends_with(kMagic) || headOf(bytes).opcode != Opcode::kFooter || !footer) return std::nullopt;
  if (footer->summary < kMagic.size() || footer->summary > footerAt || footerAt - footer->summary > kLongestSummary) {
    return std::nullopt;
  }
  if (auto got = file_.read(footer->summary, end - kMagic.size() - footer->summary, bytes); !got) {
    return tl::unexpected(got.error());
  }
  if (footer->crc != 0 && crcOf(std::string_view(bytes).substr(0, bytes.size() - 4)) != footer->crc)
    return std::nullopt;
  Declared summary;
  Input in(std::string_view(bytes).substr(0, bytes.size() - kFooterBytes));
  while (!in.empty()) {
    const Head head = headOf(in.bytes(kRecordHead));
    const std::string_view content = in.bytes(head.length);
    if (!in.ok() || (isDeclaration(head.opcode) && !add(summary, head.opcode, content))) return std::nullopt;
  }
  return summary;
}

tl::expected<Extent, Error> recover(const Reader& from, Sink& to) {
  Writer writer(to, {.syncChunks = false, .library = "tractionctl recover"});
  std::map<const Schema*, std::uint16_t> schemas = {{nullptr, 0}};
  std::map<std::uint16_t, std::uint16_t> channels;
  tl::expected<void, Error> written;
  auto extent = from.read([&](const Channel& channel, const Schema* schema, const Message& message) {
    if (!written) return;
    auto ours = channels.find(channel.id);
    if (ours == channels.end()) {
      if (!schemas.contains(schema)) schemas[schema] = writer.schema(schema->name, schema->encoding, schema->data);
      const auto id = writer.channel(schemas[schema], channel.topic, channel.encoding, channel.metadata);
      ours = channels.emplace(channel.id, id).first;
    }
    Message copy = message;
    copy.channel = ours->second;
    written = writer.write(copy);
  });
  if (!extent) return extent;
  if (written) written = writer.close();
  if (!written) return tl::unexpected(written.error());
  return extent;
}

}  // namespace recording

// Reads a recording, also one that was cut off or is damaged: its bytes are from outside, and nothing in them is
// believed.
#pragma once

#include "recording/file.h"
#include "recording/records.h"

#include <functional>
#include <optional>
#include <string>

namespace recording {

/// How a reading went.
struct Extent {
  bool closed = false;            ///< it has its end, and nothing behind it
  std::uint64_t whole_bytes = 0;  ///< up to the last whole record
  std::uint64_t chunks = 0;       ///< whose messages were read
  std::uint64_t badChunks = 0;    ///< left out: damaged, or compressed
  std::string library;            ///< who wrote it, as it says
  std::string trouble;            ///< what is wrong, for people; empty: nothing

  bool isWhole() const { return trouble.empty(); }
};

/// What stands behind the messages of a recording that was closed.
struct Summary {
  std::map<std::uint16_t, Schema> schemas;
  std::map<std::uint16_t, Channel> channels;
  std::vector<ChunkIndex> chunks;
  Statistics statistics;
};

class Reader {
 public:
  /// EX_NOINPUT: cannot be read; EX_DATAERR: empty, or no recording; EX_PROTOCOL: of a newer version.
  static tl::expected<Reader, Error> open(const std::filesystem::path& path);

  /// \param schema null: the channel has none, or one that is not there
  using Visit = std::function<void(const Channel& channel, const Schema* schema, const Message& message)>;

  /// From the beginning to the end, to the cut, or to where no record begins: all messages of whole chunks, in the
  /// order of the file. A damaged chunk is passed over. EX_IOERR.
  /// \param since_ns chunks that end before this log time are passed over, where the recording has its summary
  tl::expected<Extent, Error> read(const Visit& visit, std::uint64_t since_ns = 0) const;

  /// Without reading the messages. Empty: it was not closed, or its summary is damaged. EX_IOERR.
  tl::expected<std::optional<Summary>, Error> summary() const;

  const OldFile& file() const { return file_; }

 private:
  explicit Reader(OldFile file)
      : file_(std::move(file)) {}

  OldFile file_;
};

/// Everything that can be read of a recording, as a whole one. How the reading went.
tl::expected<Extent, Error> recover(const Reader& from, Sink& to);

}  // namespace recording

// Reads a recording, including one that was cut off or is damaged. Its bytes are untrusted.
#pragma once

#include "recording/file.h"
#include "recording/records.h"

#include <functional>
#include <optional>
#include <stop_token>
#include <string>

namespace recording {

/// Result of reading a recording.
struct Extent {
  bool closed = false;            ///< true: the file has its end, and nothing after it
  std::uint64_t whole_bytes = 0;  ///< length up to the last whole record
  std::uint64_t chunks = 0;       ///< chunks whose messages were read
  std::uint64_t messages = 0;     ///< messages that were visited
  std::uint64_t badChunks = 0;    ///< chunks skipped because they are damaged, too large, or of another compression
  std::string library;            ///< name that the writing program left; empty: none
  std::string trouble;            ///< what is wrong, as text; empty: nothing

  bool isWhole() const { return trouble.empty(); }  ///< Returns whether nothing is wrong.
};

/// Most that the declarations of a recording may have [bytes]; further ones are taken for damage.
inline constexpr std::uint64_t kMostDeclared = 16 << 20;

/// What a recording declares, or its summary section alone.
struct Declared {
  std::map<std::uint16_t, Schema> schemas;    ///< by id
  std::map<std::uint16_t, Channel> channels;  ///< by id
  std::uint64_t bytes = 0;                    ///< of their records; at most kMostDeclared
  bool isFull = false;                        ///< there were more
};

/// A recording opened for reading. Thread-bound. Bytes that are appended after open() are not read.
class Reader {
 public:
  /// Opens a recording and reads its first bytes. Errors: EX_NOINPUT if it cannot be opened, EX_IOERR if it cannot be
  /// read, EX_DATAERR if it is empty, cut off within its first bytes or not a recording, EX_PROTOCOL if it is of a
  /// newer version.
  static tl::expected<Reader, Error> open(const std::filesystem::path& path);

  /// Called by read() for each message. The arguments are valid during the call only. What it throws ends the reading
  /// and leaves read().
  /// \param schema null: the channel has none, or its schema is missing
  using Visit = std::function<void(const Channel& channel, const Schema* schema, const Message& message)>;

  /// Reads from the beginning to the end, to a cut, to a damaged record outside the chunks, or to a record of more than
  /// 65 MiB, and visits all messages of intact chunks, and those outside of chunks, in the order of the file; those of
  /// chunks compressed by zstd or lz4, too. Skips damaged chunks and those above kLargestChunk. Channels and schemas
  /// that the chunks lack are those of the summary. A damaged or cut recording is no error: see Extent::trouble. Waits
  /// for the disk. Error: EX_IOERR.
  /// \param since_ns skips chunks whose last log time is earlier [ns since 1970], if the recording has a summary, and
  /// does not count them; earlier messages of other chunks are visited. 0: skips none
  /// \param stop is looked at before each record and message; the extent is then what was read before
  tl::expected<Extent, Error> read(const Visit& visit, std::uint64_t since_ns = 0,
                                   const std::stop_token& stop = {}) const;

  /// Reads what the summary declares, without the messages. Returns nothing, without an error, if the recording was not
  /// closed, has no summary, or that is damaged or larger than 256 MiB. Error: EX_IOERR.
  tl::expected<std::optional<Declared>, Error> summary() const;

  const OldFile& file() const { return file_; }  ///< Returns the file that is read.

 private:
  explicit Reader(OldFile file)
      : file_(std::move(file)) {}

  OldFile file_;
};

/// Copies every readable message, with its channel and schema, into a new, whole recording, and syncs it at the end.
/// Attachments and metadata records are not copied. Returns how the reading went: damage of `from` is no error. Errors:
/// EX_IOERR of reading, and those of `to`; `to` then has no end.
/// \param to must be empty
tl::expected<Extent, Error> recover(const Reader& from, Sink& to);

}  // namespace recording

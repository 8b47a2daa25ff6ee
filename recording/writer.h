// Writes a recording chunk by chunk. Each chunk is on disk before the next begins; an index follows at the end.
#pragma once

#include "recording/file.h"
#include "recording/records.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace recording {

struct WriterOptions {
  std::uint64_t chunkTime_ns = 150'000'000;  ///< longest time from a chunk's first message to its end, in log time
  std::size_t chunkBytes = 1 << 20;          ///< size at which a chunk ends sooner
  bool syncChunks = true;                    ///< false: only close() syncs
  std::string library;                       ///< name of the writing program
};

/// Writes to a sink. Thread-bound. Errors are those of the sink, except where stated. After an error of the
/// sink the messages of the current chunk are lost and only close() may be called: it ends the file behind the chunks
/// already written, for which room was reserved if the sink can. The destructor does not close: what is not written is
/// lost, and the file has no end.
class Writer {
 public:
  /// Writes nothing yet.
  /// \param sink must be empty, and outlive the writer
  Writer(Sink& sink, WriterOptions options);

  /// Declares a schema and returns its id for channel(), from 1. It is written before the next chunk. Names are not
  /// compared: each call declares another one, up to 65,535.
  std::uint16_t schema(std::string_view name, std::string_view encoding, std::string_view data);
  /// Declares a channel and returns its id for Message::channel, from 1, up to 65,535. Topics are not compared.
  /// \param schema id of schema(); 0: none
  std::uint16_t channel(std::uint16_t schema, std::string_view topic, std::string_view encoding,
                        std::map<std::string, std::string> metadata = {});

  /// Adds a copy of a message to the current chunk. If that chunk is due or full, does flush() first, and so waits for
  /// the disk; if that fails, the message is not added. Fails with EX_DATAERR if the message is larger than a chunk may
  /// be (kLargestChunk). The message's channel must have been declared.
  tl::expected<void, Error> write(const Message& message);
  /// Returns the log time of the first message not written yet; nothing if all are written.
  std::optional<std::uint64_t> oldest_ns() const;
  /// Returns whether the current chunk began at least chunkTime_ns before `now_ns`, in log time.
  bool isDue(std::uint64_t now_ns) const;
  /// Writes what is not written yet (at first the file's beginning, then new declarations and the current chunk) and,
  /// by default, syncs it. Does nothing if there is nothing. The caller should call it when isDue(): write() alone
  /// leaves the last chunk unwritten until the next message.
  tl::expected<void, Error> flush();
  /// Writes the last chunk, the summary and the end, and syncs. Writes the end even if the last chunk fails, and then
  /// returns that error. Once the end is written, further calls do nothing; before, they try again. Nothing may be
  /// declared or written after the end.
  tl::expected<void, Error> close();

  /// Returns counts of what was written, without the current chunk. Those of schemas and channels are 0 until close().
  const Statistics& statistics() const { return statistics_; }

 private:
  /// Appends the current chunk and its message indexes to `bytes`, and fills `index`.
  void addChunk(std::string& bytes, ChunkIndex& index);

  Sink& sink_;
  WriterOptions options_;
  std::uint64_t written_ = 0;  ///< bytes
  std::string pending_;        ///< records to write before the next chunk
  std::vector<Schema> schemas_;
  std::vector<Channel> channels_;
  std::string records_;  ///< of the current chunk
  bool closed_ = false;
  std::uint64_t first_ns_ = 0, begin_ns_ = 0, end_ns_ = 0;
  std::map<std::uint16_t, IndexEntries> entries_;
  std::vector<ChunkIndex> chunks_;
  Statistics statistics_;
};

}  // namespace recording

// Writes a recording: chunk after chunk, each on disk before the next begins, an index of them all at the end.
#pragma once

#include "recording/file.h"
#include "recording/records.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace recording {

struct WriterOptions {
  std::uint64_t chunkTime_ns = 150'000'000;  ///< from a chunk's first message to its end, by log time
  std::size_t chunkBytes = 1 << 20;          ///< after which it ends sooner
  bool syncChunks = true;                    ///< false: close() alone syncs
  std::string library;                       ///< who writes, for people
};

/// Thread-bound. After an error what the chunk had is forgotten, and close() alone is left: it gives what was written
/// before its end, for which room was kept, where the sink can.
class Writer {
 public:
  /// \param sink empty, and outlives the writer
  Writer(Sink& sink, WriterOptions options);

  /// An id for channels. What is declared here is written before the next chunk.
  std::uint16_t schema(std::string_view name, std::string_view encoding, std::string_view data);
  /// An id for messages. \param schema 0: none
  std::uint16_t channel(std::uint16_t schema, std::string_view topic, std::string_view encoding,
                        std::map<std::string, std::string> metadata = {});

  /// Its chunk is written when it is due: at a later write(), flush() or close().
  tl::expected<void, Error> write(const Message& message);
  /// Log time of the first message that is not written yet.
  std::optional<std::uint64_t> oldest_ns() const;
  bool isDue(std::uint64_t now_ns) const;
  /// Writes what there is, and syncs it.
  tl::expected<void, Error> flush();
  /// The index and the end, once. An error of the last chunk is no reason not to try.
  tl::expected<void, Error> close();

  /// Of what is written.
  const Statistics& statistics() const { return statistics_; }

 private:
  void addChunk(std::string& bytes, ChunkIndex& index);
  /// Adds to pending_ what the summary repeats.
  template <typename Record>
  void declare(const Record& record);
  /// What is not written: there may be no room for it at the end, either.
  void forgetPending();
  /// Of all that stands behind the last chunk, at most [bytes].
  std::uint64_t endBytes(std::uint64_t ofIndex) const;

  Sink& sink_;
  WriterOptions options_;
  std::uint64_t written_ = 0;  ///< bytes
  std::string pending_;        ///< records that stand before the next chunk
  std::uint64_t summary_ = 0;  ///< bytes of the schemas, channels and chunk indexes at the end
  struct {
    std::size_t schemas = 0, channels = 0;
    std::uint64_t summary = 0;
  } kept_;  ///< how many of them, and how many bytes, are of what is written
  std::vector<Schema> schemas_;
  std::vector<Channel> channels_;
  std::string records_;  ///< of the chunk that grows
  bool closed_ = false;
  std::uint64_t first_ns_ = 0, begin_ns_ = 0, end_ns_ = 0;
  std::map<std::uint16_t, IndexEntries> entries_;
  std::vector<ChunkIndex> chunks_;
  Statistics statistics_;
};

}  // namespace recording

// Writes the log, so that no thread that logs waits for the reader.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace tractiond {

struct LineWriterOptions {
  std::size_t most_bytes = std::size_t{256} << 10;  ///< that may wait for the reader; further lines are lost
  std::chrono::milliseconds patience{500};          ///< time to write the rest at the end
  std::string prefix = "tractiond: ";               ///< of the line that states the number of lost lines
};

/// Writes lines to a descriptor on a thread of its own. A full pipe, or a terminal that is stopped, blocks that thread
/// alone: lines without room are counted, and a line in their place states their number.
class LineWriter {
 public:
  /// \param descriptor must stay open until the process ends
  explicit LineWriter(int descriptor, const LineWriterOptions& options = {});
  LineWriter(const LineWriter&) = delete;
  LineWriter& operator=(const LineWriter&) = delete;
  /// Calls drain().
  ~LineWriter();

  /// Waits for the reader, for `patience` at most. Nothing is written after it. Any thread.
  void drain();

  /// Queues a line, without its end. Any thread.
  void write(std::string_view line);

  /// Returns the number of lines lost since the start. Any thread.
  std::uint64_t lost() const;

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;  // shared with the thread, which may live longer while the reader stands still
};

}  // namespace tractiond

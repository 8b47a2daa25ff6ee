// Writes the log's lines, so that no thread that logs waits for the reader.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace tractiond {

struct LineWriterOptions {
  std::size_t most_bytes = std::size_t{256} << 10;  ///< queued for the reader; further lines are lost
  std::chrono::milliseconds patience{500};          ///< longest wait of drain()
  std::string prefix = "tractiond: ";               ///< of the line that states how many lines were lost
};

/// Writes lines to a descriptor from a thread of its own. A full pipe or a stopped terminal blocks only that thread:
/// lines for which there is no room are counted, and a line in their place states how many were lost.
class LineWriter {
 public:
  /// Starts the thread. \throws std::system_error if no thread can be started
  /// \param descriptor must stay open until the process ends; not closed by the writer
  explicit LineWriter(int descriptor, const LineWriterOptions& options = {});
  LineWriter(const LineWriter&) = delete;
  LineWriter& operator=(const LineWriter&) = delete;
  /// Calls drain(), and so waits at most for `patience`.
  ~LineWriter();

  /// Waits until the queued lines are written, at most for `patience`; those left then, and later lines, are not
  /// written. Any thread.
  void drain();

  /// Queues a line; does not wait. The line is lost if there is no room, or if the loss of an earlier one has not been
  /// stated yet. Any thread. \param line without its line end
  void write(std::string_view line);

  /// Returns the number of lines lost since the start: no room, a full disk, or no reader. Lines that drain() leaves
  /// unwritten, and later ones while there is room for them, are not counted. Any thread.
  std::uint64_t lost() const;

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;  // shared with the thread, which may live longer while the reader stands still
};

}  // namespace tractiond

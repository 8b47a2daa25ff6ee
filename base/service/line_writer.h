// The log's way out: nobody who logs waits for who reads.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace tractiond {

struct LineWriterOptions {
  std::size_t most_bytes = std::size_t{256} << 10;  ///< that wait for the reader; what comes on top is lost
  std::chrono::milliseconds patience{500};          ///< at the end, for what still waits
  std::string prefix = "tractiond: ";               ///< of the line that says how many are lost
};

/// Writes lines to a descriptor from a thread of its own. A pipe that is full, or a terminal that stands still, holds
/// up that thread and nobody else: lines for which there is no room are counted, and a line in their place says how
/// many.
class LineWriter {
 public:
  /// \param descriptor stays open for as long as the process lives
  explicit LineWriter(int descriptor, const LineWriterOptions& options = {});
  LineWriter(const LineWriter&) = delete;
  LineWriter& operator=(const LineWriter&) = delete;
  /// As drain().
  ~LineWriter();

  /// Waits for the reader, no longer than its patience. Nothing is written after it. Any thread.
  void drain();

  /// Any thread. \param line without its end
  void write(std::string_view line);

  /// Lines lost since the start. Any thread.
  std::uint64_t lost() const;

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;  // with the thread, which a reader that stands still may keep beyond this
};

}  // namespace tractiond

// Writes raw pictures into a file or a pipe, one after another without separators: the input of `tractiond --images`.
#pragma once

#include "twin/failure.h"

#include <tl/expected.hpp>

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace twin {

/// Thread-bound, but another thread or a signal handler may set `stop`.
class PictureWriter {
 public:
  /// Opens and empties a file, or opens a pipe and waits for its reader. Error: EX_CANTCREAT, also if `stop` ends the
  /// wait (within 50 ms).
  /// \param path "-": standard output
  /// \param stop when set, ends every wait for a reader; must outlive the writer
  static tl::expected<std::unique_ptr<PictureWriter>, Failure> open(const std::string& path,
                                                                    const std::atomic<bool>& stop);
  ~PictureWriter();  ///< Closes the file, but not standard output.
  PictureWriter(const PictureWriter&) = delete;
  PictureWriter& operator=(const PictureWriter&) = delete;

  /// Writes a whole picture and waits for the reader of a pipe; returns early and without an error, with less of it
  /// written, if `stop` is set. Error: EX_IOERR, also if the reader has closed the pipe.
  /// SIGPIPE must be ignored.
  tl::expected<void, Failure> write(std::span<const std::uint8_t> pixels);

 private:
  PictureWriter(std::string path, int descriptor, const std::atomic<bool>& stop);

  std::string path_;
  int descriptor_;
  const std::atomic<bool>& stop_;
};

}  // namespace twin

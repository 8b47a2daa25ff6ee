// Raw pictures into a file or a pipe, one behind the other without anything between them: what `tractiond --images`
// reads.
#pragma once

#include "twin/failure.h"

#include <tl/expected.hpp>

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace twin {

/// Thread-bound; only `stop` may be set by others, or by a signal.
class PictureWriter {
 public:
  /// Opens a file, which is emptied, or a pipe, for whose reader it waits; "-" is standard output. Fails with
  /// EX_CANTCREAT. Setting `stop` ends every wait for a reader; it must outlive the writer.
  static tl::expected<std::unique_ptr<PictureWriter>, Failure> open(const std::string& path,
                                                                    const std::atomic<bool>& stop);
  ~PictureWriter();
  PictureWriter(const PictureWriter&) = delete;
  PictureWriter& operator=(const PictureWriter&) = delete;

  /// Writes all of a picture, or what has been read of it when `stop` is set. Fails with EX_IOERR, also where the
  /// reader has gone; SIGPIPE must be ignored.
  tl::expected<void, Failure> write(std::span<const std::uint8_t> pixels);

 private:
  PictureWriter(std::string path, int descriptor, const std::atomic<bool>& stop);

  std::string path_;
  int descriptor_;
  const std::atomic<bool>& stop_;
};

}  // namespace twin

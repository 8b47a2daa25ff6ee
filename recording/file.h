// Files of recordings: a new one that only grows, and an old one that is only read.
#pragma once

#include "base/error.h"
#include "base/whole_file.h"

#include <tl/expected.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace recording {

using tractiond::Error;

/// Destination of a writer's bytes.
class Sink {
 public:
  virtual ~Sink() = default;
  /// Appends all bytes, or none if it fails.
  /// \param bytes need not outlive the call
  /// \param reserve number of bytes for which room is to be kept behind them; 0 also gives back room that was kept
  /// before. A sink may ignore it.
  virtual tl::expected<void, Error> append(std::string_view bytes, std::uint64_t reserve) = 0;
  /// Waits until everything that was appended survives a power failure.
  virtual tl::expected<void, Error> sync() = 0;
};

/// A new file. Thread-bound. append() and sync() fail with EX_IOERR, and wait for the disk.
class NewFile : public Sink {
 public:
  /// Creates the file in an existing directory and makes its name durable, if the file system can: a failure of that is
  /// not reported. Error: EX_CANTCREAT, also if a file of this name exists: a recording is never overwritten.
  static tl::expected<NewFile, Error> create(const std::filesystem::path& path);

  /// Appends all bytes, or none if it fails, also if there is no room for `reserve` bytes behind them. File systems
  /// without fallocate() keep no room. If `reserve` is 0, gives back the room that was kept.
  tl::expected<void, Error> append(std::string_view bytes, std::uint64_t reserve) override;
  tl::expected<void, Error> sync() override;
  /// Returns the number of bytes appended.
  std::uint64_t size() const { return size_; }

 private:
  NewFile(int file, std::filesystem::path path);
  Error failure(int error) const;
  /// Removes what a failed append() wrote, and gives back reserved room; best effort.
  void truncate();

  tractiond::OpenFile file_;
  std::filesystem::path path_;
  std::uint64_t size_ = 0;
};

/// A file of which only the bytes present at opening are read. Thread-bound.
class OldFile {
 public:
  /// Opens a regular file. Error: EX_NOINPUT, also if the path is of another kind.
  static tl::expected<OldFile, Error> open(const std::filesystem::path& path);

  /// Returns the size at opening [bytes].
  std::uint64_t size() const { return size_; }
  /// Returns the path that was given to open().
  const std::filesystem::path& path() const { return path_; }
  /// Replaces `to` by `count` bytes from `offset`. Waits for the disk. Error: EX_IOERR, also if they do not lie below
  /// size(), the file has become shorter or there is no memory; `to` is then empty.
  tl::expected<void, Error> read(std::uint64_t offset, std::uint64_t count, std::string& to) const;

 private:
  OldFile(tractiond::OpenFile file, std::filesystem::path path, std::uint64_t size);

  tractiond::OpenFile file_;
  std::filesystem::path path_;
  std::uint64_t size_;
};

}  // namespace recording

// Files: one that is only ever added to, and one that is read.
#pragma once

#include "daemon/base/error.h"

#include <tl/expected.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace recording {

using tractiond::Error;

/// Where a writer puts its bytes.
class Sink {
 public:
  virtual ~Sink() = default;
  /// All of them, behind what is there, or none. \param reserve bytes for which there is to be room behind them
  virtual tl::expected<void, Error> append(std::string_view bytes, std::uint64_t reserve) = 0;
  /// Until what was appended outlives a power cut.
  virtual tl::expected<void, Error> sync() = 0;
};

/// A new file. Thread-bound. Errors: EX_IOERR.
class NewFile : public Sink {
 public:
  /// EX_CANTCREAT, also where there is one of this name: what was recorded is not overwritten.
  static tl::expected<NewFile, Error> create(const std::filesystem::path& path);
  ~NewFile() override;
  NewFile(NewFile&& other) noexcept;
  NewFile& operator=(NewFile&&) = delete;

  tl::expected<void, Error> append(std::string_view bytes, std::uint64_t reserve) override;
  tl::expected<void, Error> sync() override;
  std::uint64_t size() const { return size_; }

 private:
  NewFile(int fd, std::filesystem::path path);
  Error failure(int error) const;

  int fd_;
  std::filesystem::path path_;
  std::uint64_t size_ = 0;
};

/// As long as it was when it was opened. Thread-bound.
class OldFile {
 public:
  /// EX_NOINPUT
  static tl::expected<OldFile, Error> open(const std::filesystem::path& path);
  ~OldFile();
  OldFile(OldFile&& other) noexcept;
  OldFile& operator=(OldFile&&) = delete;

  std::uint64_t size() const { return size_; }
  const std::filesystem::path& path() const { return path_; }
  /// Bytes that are all below size(), in place of what `to` holds. EX_IOERR, also if the file has become shorter.
  tl::expected<void, Error> read(std::uint64_t offset, std::uint64_t count, std::string& to) const;

 private:
  OldFile(int fd, std::filesystem::path path, std::uint64_t size);

  int fd_;
  std::filesystem::path path_;
  std::uint64_t size_;
};

}  // namespace recording

// Reads and replaces small files as a whole. Reentrant.
#pragma once

#include "base/files.h"

#include <fcntl.h>
#include <tl/expected.hpp>

#include <cerrno>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace tractiond {

/// An open file, closed with its owner.
class OpenFile {
 public:
  explicit OpenFile(int file)
      : file_(file) {}
  OpenFile(OpenFile&& other) noexcept
      : file_(std::exchange(other.file_, -1)) {}
  OpenFile& operator=(OpenFile&&) = delete;
  ~OpenFile() {
    if (file_ >= 0) files::close(file_);
  }
  int get() const { return file_; }  ///< Returns the descriptor.

  /// Reads up to `count` bytes. Returns how many there were, 0 at the end of the file, or -1 with errno. A signal does
  /// not end it.
  ssize_t read(void* bytes, std::size_t count) const {
    for (;;) {
      const ssize_t got = files::read(file_, bytes, count);
      if (got >= 0 || errno != EINTR) return got;
    }
  }

 private:
  int file_;
};

/// Opens a file for reading. Never waits for a pipe or a device. Fails if it is not a regular one (not_supported), as a
/// pipe or a device has no end; otherwise with the errno of open().
inline tl::expected<OpenFile, std::error_code> openRegularFile(const std::filesystem::path& path) {
  const int file = files::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (file < 0) return tl::unexpected(std::error_code(errno, std::generic_category()));
  OpenFile open(file);
  if (!files::isRegular(file)) return tl::unexpected(std::make_error_code(std::errc::not_supported));
  return open;
}

/// Returns all bytes of a file. Waits for the disk. Fails as openRegularFile(), if the file has more than `most` bytes
/// (file_too_large), or with the errno of read().
inline tl::expected<std::vector<char>, std::error_code>
readWholeFile(const std::filesystem::path& path, std::size_t most = std::numeric_limits<std::size_t>::max()) {
  const auto file = openRegularFile(path);
  if (!file) return tl::unexpected(file.error());
  std::vector<char> bytes;
  for (std::size_t size = 0;;) {
    bytes.resize(size + 65536);
    const ssize_t count = file->read(bytes.data() + size, bytes.size() - size);
    if (count < 0) return tl::unexpected(std::error_code(errno, std::generic_category()));
    size += static_cast<std::size_t>(count);
    if (size > most) return tl::unexpected(std::make_error_code(std::errc::file_too_large));
    if (count == 0) return bytes.resize(size), bytes;
  }
}

/// Synchronises the names of the files in a directory, so that they survive a loss of power. Waits for the disk.
/// Returns the error; an empty code on success, and where the file system cannot synchronise directories.
inline std::error_code synchroniseNames(const std::filesystem::path& directory) {
  const int file = files::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (file < 0) return {errno, std::generic_category()};
  const int synchronised = files::fsync(file);
  const std::error_code error(synchronised == 0 || errno == EINVAL ? 0 : errno, std::generic_category());
  files::close(file);
  return error;
}

/// Replaces or creates a file as a whole or not at all, also if power is lost: writes PATH.unfinished, synchronises it,
/// renames it to PATH and synchronises the directory. If only the last step fails, the file is replaced, but a loss of
/// power may undo that. A file or link PATH.unfinished that exists is replaced, and removed after an error; if PATH is
/// a symbolic link, the link is replaced. Waits for the disk. Returns the errno of the step that failed; an empty code
/// on success. Two calls for the same path must not overlap.
/// \param pieces of the content, one after the other
/// \param mode permissions of the new file, from which the process's umask is subtracted; those of the replaced file
/// are not kept, nor is its owner
inline std::error_code replaceWholeFile(const std::filesystem::path& path,
                                        std::span<const std::span<const char>> pieces, mode_t mode = 0644) {
  const std::filesystem::path unfinished = path.string() + ".unfinished";
  const auto failed = [&unfinished](int file) {
    const std::error_code error(errno, std::generic_category());
    if (file >= 0) files::close(file);
    files::unlink(unfinished.c_str());
    return error;
  };
  files::unlink(unfinished.c_str());  // a link would be followed, and a file would keep its mode
  const int file = files::open(unfinished.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
  if (file < 0) return failed(file);
  for (std::span<const char> bytes : pieces) {
    while (!bytes.empty()) {
      const ssize_t count = files::write(file, bytes.data(), bytes.size());
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) return failed(file);
      bytes = bytes.subspan(static_cast<std::size_t>(count));
    }
  }
  if (files::fsync(file) != 0) return failed(file);
  if (files::close(file) != 0) return failed(-1);
  if (files::rename(unfinished.c_str(), path.c_str()) != 0) return failed(-1);
  return synchroniseNames(path.has_parent_path() ? path.parent_path() : std::filesystem::path("."));
}

/// Does the same with a content in one piece.
inline std::error_code replaceWholeFile(const std::filesystem::path& path, std::span<const char> bytes,
                                        mode_t mode = 0644) {
  return replaceWholeFile(path, std::span<const std::span<const char>>(&bytes, 1), mode);
}

}  // namespace tractiond

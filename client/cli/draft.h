// Writes a file atomically.
#pragma once

#include "client/files/file_error.h"

#include <sysexits.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>

namespace traction::client {

/// A temporary file beside the target, which replaces the target on finish() and is otherwise deleted. Nothing is
/// synced: after a loss of power the target may be incomplete. Thread-bound.
class Draft {
 public:
  /// Creates the temporary file PATH.part, empty, and replaces an existing one. \throws FileError (EX_CANTCREAT)
  explicit Draft(std::string path)
      : path_(std::move(path)) {
    std::FILE* const file = std::fopen(part().c_str(), "w");
    if (file == nullptr) throw FileError(EX_CANTCREAT, path_ + " cannot be created: " + std::strerror(errno));
    std::fclose(file);
  }
  /// Deletes the temporary file unless finish() has succeeded.
  ~Draft() {
    std::error_code unknown;
    if (!done_) std::filesystem::remove(part(), unknown);
  }
  Draft(const Draft&) = delete;
  Draft& operator=(const Draft&) = delete;

  /// Returns the path of the temporary file.
  std::string part() const { return path_ + ".part"; }
  /// Replaces the target, which need not exist, by the temporary file, which must be closed. Called at most once.
  /// \throws FileError (EX_CANTCREAT): the target is then as before
  void finish() {
    std::error_code error;
    std::filesystem::rename(part(), path_, error);
    if (error) throw FileError(EX_CANTCREAT, path_ + ": " + error.message());
    done_ = true;
  }

 private:
  std::string path_;
  bool done_ = false;
};

}  // namespace traction::client

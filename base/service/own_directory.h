// Directories of one instance of a program.
#pragma once

#include "base/error.h"

#include <tl/expected.hpp>

#include <filesystem>
#include <string>
#include <string_view>

namespace tractiond {

/// Returns an absolute path from the environment; empty if there is none.
std::filesystem::path fromEnvironment(const char* variable);

/// Returns the directory in which an instance of `program` makes its sockets: systemd's $RUNTIME_DIRECTORY, else for
/// root the last and for other users the first of traction::runtimeDirectories(). Reentrant.
std::filesystem::path runtimeDirectory(const std::string& instance, std::string_view program);

/// A directory that this process holds exclusively. The directory itself is locked, so that no lock file stays behind.
class OwnDirectory {
 public:
  /// Locks the directory and creates it, with its parents, if it is missing. Does not wait for the lock. EX_TEMPFAIL:
  /// another process holds it. EX_NOPERM: no permission to create, open or write it, or another user may control it:
  /// every user can write into it; or, below a directory like /tmp, it or its parent belongs to another user than this
  /// one and root. EX_CANTCREAT: it cannot be created or opened for another reason.
  /// \param what name for the error, of which the first word names the option that states it: "state directory"
  /// \param program for the error, too
  static tl::expected<OwnDirectory, Error> claim(const std::filesystem::path& path, const std::string& what,
                                                 const std::string& program = "tractiond");
  OwnDirectory(OwnDirectory&& other) noexcept;  ///< Takes over the lock; `other` holds none afterwards.
  OwnDirectory& operator=(OwnDirectory&&) = delete;
  /// Unlocks the directory; removes it if claim() created it and it is empty, but no parent. Does nothing after a move.
  ~OwnDirectory();

 private:
  OwnDirectory(std::filesystem::path path, int descriptor, bool made);

  std::filesystem::path path_;
  int descriptor_;
  bool made_;
};

}  // namespace tractiond

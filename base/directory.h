// Lists a directory, and tells who can write into it. Reentrant.
#pragma once

#include <sys/stat.h>

#include <filesystem>
#include <system_error>
#include <vector>

namespace tractiond {

/// Returns the paths of a directory's entries, in no order. If it cannot be read to its end, returns those before the
/// error.
inline std::vector<std::filesystem::path> entriesOf(const std::filesystem::path& directory) {
  std::vector<std::filesystem::path> paths;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(directory, error), end; !error && entry != end; entry.increment(error))
    paths.push_back(entry->path());
  return paths;
}

/// Returns whether every user can write into this directory or file. A symbolic link itself (lstat()) cannot be
/// written.
inline bool canOthersWrite(const struct stat& of) {
  return !S_ISLNK(of.st_mode) && (of.st_mode & S_IWOTH) != 0;
}

}  // namespace tractiond

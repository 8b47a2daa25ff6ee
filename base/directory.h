// Lists a directory, and tells who can write into it or control it. Reentrant.
#pragma once

#include <sys/stat.h>
#include <unistd.h>

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

/// Returns whether another user may control a directory: every user can write into it, or into the directory that it is
/// in, or the one above that, as /tmp, where each name belongs to the first who takes it. Also if that is not known.
/// \param own of the directory as it is used
inline bool canOthersControl(const std::filesystem::path& directory, const struct stat& own) {
  const auto isTrusted = [](const struct stat& of) {
    return (of.st_uid == geteuid() || of.st_uid == 0) && !canOthersWrite(of);
  };
  struct stat link {
  }, parent{}, above{};
  std::error_code failure;
  std::filesystem::path name = std::filesystem::absolute(directory, failure).lexically_normal();
  if (!name.has_filename()) name = name.parent_path();  // without the slash at the end
  const std::filesystem::path folder = name.parent_path();
  if (failure || lstat(name.c_str(), &link) != 0) return true;
  if (stat(folder.c_str(), &parent) != 0 || stat(folder.parent_path().c_str(), &above) != 0) return true;
  if (canOthersWrite(own)) return true;
  if (canOthersWrite(parent) && !(isTrusted(own) && isTrusted(link))) return true;
  return canOthersWrite(above) && (lstat(folder.c_str(), &parent) != 0 || !isTrusted(parent));
}

/// Returns the same of a directory that need not exist: then of the one that it would be in; false if that is missing.
inline bool canOthersControl(const std::filesystem::path& directory) {
  struct stat own {};
  if (stat(directory.c_str(), &own) == 0) return canOthersControl(directory, own);
  const std::filesystem::path parent = directory.parent_path();
  return stat(parent.c_str(), &own) == 0 && canOthersControl(parent, own);
}

}  // namespace tractiond

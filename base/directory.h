// Lists a directory. Reentrant.
#pragma once

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

}  // namespace tractiond

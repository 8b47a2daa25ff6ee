#include "client/cli/instances.h"

#include "proto/traction/v1/endpoints.h"

#include <filesystem>

namespace traction::cli {

namespace fs = std::filesystem;

std::set<std::string> instancesHere() {
  std::set<std::string> names;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator("/etc/tractiond", ignored)) {
    const std::string name = entry.path().stem();
    if (entry.path().extension() == ".toml" && isValidName(name)) names.insert(name);
  }
  for (const fs::path& example : runtimeDirectories(kDefaultInstance)) {
    for (const auto& entry : fs::directory_iterator(example.parent_path(), ignored)) {
      const std::string name = entry.path().filename();
      if (isValidName(name) && fs::is_socket(entry.path() / "control", ignored)) names.insert(name);
    }
  }
  if (names.empty()) names.insert(kDefaultInstance);
  return names;
}

}  // namespace traction::cli

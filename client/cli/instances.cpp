#include "client/cli/instances.h"

#include "base/directory.h"
#include "proto/traction/v1/endpoints.h"

#include <filesystem>
#include <system_error>

namespace traction::client {

namespace fs = std::filesystem;

std::set<std::string> instancesHere() {
  std::set<std::string> names;
  for (const fs::path& file : tractiond::entriesOf("/etc/tractiond")) {
    const std::string name = file.stem();
    if (file.extension() == ".toml" && isValidName(name)) names.insert(name);
  }
  for (const fs::path& example : runtimeDirectories(kDefaultInstance)) {
    for (const fs::path& directory : tractiond::entriesOf(example.parent_path())) {
      const std::string name = directory.filename();
      std::error_code ignored;
      if (isValidName(name) && fs::is_socket(directory / "control", ignored)) names.insert(name);
    }
  }
  if (names.empty()) names.insert(kDefaultInstance);
  return names;
}

}  // namespace traction::client

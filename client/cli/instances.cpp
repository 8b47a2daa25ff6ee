#include "client/cli/instances.h"

#include "base/directory.h"
#include "proto/traction/v1/endpoints.h"

#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <vector>

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

std::optional<int> subscribersOf(const std::string& endpoint, const fs::path& tables) {
  const auto count = [&](const char* table, auto&& isOne) -> std::optional<int> {
    std::ifstream file(tables / table);
    std::string line;
    if (!std::getline(file, line)) return std::nullopt;  // the heading
    int connections = 0;
    while (std::getline(file, line)) {
      std::istringstream words(line);
      const std::vector<std::string> all{std::istream_iterator<std::string>(words),
                                         std::istream_iterator<std::string>()};
      connections += isOne(all) ? 1 : 0;
    }
    return connections;
  };
  // The accepted ends have the listener's name; connected: state 03 of unix(7)'s, 01 of TCP's.
  if (endpoint.rfind("ipc://", 0) == 0) {
    const std::string path = endpoint.substr(6);
    return count("unix", [&](const auto& all) { return all.size() == 8 && all[5] == "03" && all[7] == path; });
  }
  constexpr const char* kLoopback = "tcp://127.0.0.1:";
  if (endpoint.rfind(kLoopback, 0) != 0) return std::nullopt;
  std::array<char, 32> local{};
  std::snprintf(local.data(), local.size(), "0100007F:%04X",
                static_cast<unsigned>(std::strtoul(&endpoint[std::char_traits<char>::length(kLoopback)], nullptr, 10)));
  return count("tcp", [&](const auto& all) { return all.size() > 3 && all[1] == local.data() && all[3] == "01"; });
}

}  // namespace traction::client

// Where the files that tests read are.
#pragma once

#include <string>

namespace tractiond::test {

/// Returns the path of a file or folder of the source tree: source("config/tractiond.toml"). Thread-safe.
std::string source(const std::string& path);

/// Returns the path of a file or folder of the build tree. Thread-safe.
std::string built(const std::string& path);

}  // namespace tractiond::test

// Reads a configuration file.
#pragma once

#include "base/error.h"
#include "daemon/config.h"

#include <tl/expected.hpp>

#include <istream>

namespace tractiond {

/// Parses a configuration; a missing key has its default. Errors name the file as `name`: "name:line: what". They have
/// EX_CONFIG: syntax, an unknown key (with the nearest known one), a wrong type, a value out of range.
tl::expected<Config, Error> parseConfig(std::istream& text, const std::string& name);

/// Loads a configuration file. The gel file's name is relative to its directory; a file called none is ./none. Fails
/// with EX_NOINPUT if there is no such file or it cannot be read.
tl::expected<Config, Error> loadConfig(const std::string& path);

}  // namespace tractiond

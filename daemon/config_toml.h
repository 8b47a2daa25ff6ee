// Reads a configuration file.
#pragma once

#include "base/error.h"
#include "daemon/config.h"

#include <tl/expected.hpp>

#include <istream>

namespace tractiond {

/// What is absent keeps its default. `name` is how errors call the file: "name:line: what". Exit code EX_CONFIG for
/// what is wrong in it: syntax, an unknown key (with the nearest known one), a wrong type, a value out of its range.
tl::expected<Config, Error> parseConfig(std::istream& text, const std::string& name);

/// The gel file's name counts from this file's directory: a file called none is ./none. EX_NOINPUT when there is no
/// such file or it cannot be read.
tl::expected<Config, Error> loadConfig(const std::string& path);

}  // namespace tractiond

// Reads a configuration file. Reentrant.
#pragma once

#include "base/error.h"
#include "daemon/app/config.h"

#include <tl/expected.hpp>

#include <istream>

namespace tractiond {

/// Parses a configuration, up to the end of `text`. Missing keys keep their defaults; the gel file's name stays as it
/// is written. EX_CONFIG: wrong syntax, an unknown key (the error states the nearest known one), a key of an earlier
/// version, a wrong type, a value out of its range or not allowed (Key::fault).
/// \param name of the file in errors: "name:line: what"; is not opened
tl::expected<Config, Error> parseConfig(std::istream& text, const std::string& name);

/// Does the same with the configuration that a recording holds: keys of earlier versions have no effect.
tl::expected<Config, Error> parseRecordedConfig(std::istream& text, const std::string& name);

/// Reads a configuration file; waits for the disk. Resolves the gel file's name relative to the file's directory,
/// except "none" (a file of that name is ./none). EX_NOINPUT: the file is missing or cannot be read. EX_CONFIG as
/// parseConfig().
tl::expected<Config, Error> loadConfig(const std::string& path);

}  // namespace tractiond

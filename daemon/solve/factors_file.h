// Reads and writes the factors of the model of contacts as a file in the byte order of this machine.
#pragma once

#include "daemon/solve/factors.h"

#include <filesystem>
#include <string>

namespace tractiond::solve {

/// Loads the factors of `atoms`, which need not outlive them. Fails with path and reason if the file cannot be read, is
/// not whole (by its checksum), is of another version of the format, or is not of this id and size.
/// \param coordinateCount 2M
tl::expected<Factors, std::string> loadFactors(const std::filesystem::path& path, const Id& id, int coordinateCount,
                                               const Atoms& atoms);

/// Writes the file. It appears under its name when it is whole and on the disk. An existing file is replaced. Fails
/// with path and reason.
tl::expected<void, std::string> saveFactors(const std::filesystem::path& path, const Factors& factors);

}  // namespace tractiond::solve

// An inverse as a file. In the machine's byte order, since the state stays on its machine.
#pragma once

#include "daemon/solve/inverse.h"

#include <filesystem>
#include <string>

namespace tractiond::solve {

/// Loads an inverse. Fails with the reason if there is no file, or it is not whole or not of this id and size.
tl::expected<Inverse, std::string> loadInverse(const std::filesystem::path& path, const Id& id, int coordinateCount,
                                               int forceCount);

/// Saves all or nothing: the file appears when it is whole and on the disk. Fails with the reason.
tl::expected<void, std::string> saveInverse(const std::filesystem::path& path, const Inverse& inverse);

}  // namespace tractiond::solve

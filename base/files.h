// Reads and writes files of the state directory: by the operating system, or on a simulated disk
// (tests/simulation), whichever is linked.
#pragma once

#include <sys/stat.h>
#include <sys/types.h>

#include <cstddef>
#include <filesystem>
#include <system_error>

namespace tractiond::files {

// These do the same as the POSIX calls of the same names: they return -1 and set errno on failure. Thread-safe.

int open(const char* path, int flags, mode_t mode = 0);
ssize_t read(int file, void* bytes, std::size_t count);
ssize_t write(int file, const void* bytes, std::size_t count);
int fsync(int file);
int close(int file);
int rename(const char* from, const char* to);
int unlink(const char* path);

/// Returns whether an open file is a regular one; false also on an error.
bool isRegular(int file);

/// Creates a directory and its parents. An existing directory is not an error, an empty path is one. Returns the error;
/// an empty code on success. Thread-safe.
std::error_code makeDirectories(const std::filesystem::path& path);

}  // namespace tractiond::files

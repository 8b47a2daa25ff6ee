#include "base/files.h"

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>

namespace tractiond::files {

int open(const char* path, int flags, mode_t mode) {
  return ::open(path, flags, mode);
}

ssize_t read(int file, void* bytes, std::size_t count) {
  return ::read(file, bytes, count);
}

ssize_t write(int file, const void* bytes, std::size_t count) {
  return ::write(file, bytes, count);
}

int fsync(int file) {
  return ::fsync(file);
}

int close(int file) {
  return ::close(file);
}

int rename(const char* from, const char* to) {
  return ::rename(from, to);
}

int unlink(const char* path) {
  return ::unlink(path);
}

bool isRegular(int file) {
  struct stat status = {};
  return fstat(file, &status) == 0 && S_ISREG(status.st_mode);
}

std::error_code makeDirectories(const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  return error;
}

}  // namespace tractiond::files

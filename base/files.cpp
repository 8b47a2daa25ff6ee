#include "base/files.h"

#include <dirent.h>
#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <string_view>

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

int status(const char* path, struct stat& of) {
  return ::stat(path, &of);
}

int statusOfLink(const char* path, struct stat& of) {
  return ::lstat(path, &of);
}

Listing list(const char* path) {
  Listing listing;
  DIR* const directory = opendir(path);
  if (directory == nullptr) {
    listing.error = errno;
    return listing;
  }
  listing.isOpened = true;
  if (fstat(dirfd(directory), &listing.own) != 0) listing.own = {};
  for (errno = 0; const dirent* const entry = readdir(directory); errno = 0) {
    const std::string_view name = entry->d_name;
    if (name == "." || name == "..") continue;
    Listing::Entry& one = listing.entries.emplace_back();
    one.name = name;
    if (fstatat(dirfd(directory), entry->d_name, &one.of, 0) != 0) one.of = {};
  }
  listing.error = errno;
  closedir(directory);
  return listing;
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

// A parser of bytes from outside, to be fed with anything: one FILE_fuzz.cpp each. It must come back, whatever the
// bytes; the sanitizers say whether it read or wrote what is not its own.
#pragma once

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

namespace fuzz {

/// Called first, by targets that have it.
[[gnu::weak]] void begin(int argc, char** argv);

/// What the parser takes for good, to begin with: of what it refuses at once nothing leads further.
std::vector<std::string> seeds();

/// Whether the parser took it for good.
bool feed(std::string_view bytes);

/// What must hold besides.
inline void require(bool holds, const char* what) {
  if (holds) return;
  std::fputs(what, stderr);
  std::abort();
}

inline std::string fileText(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// A file that is nowhere but in memory, for parsers that want a path.
class MemoryFile {
 public:
  explicit MemoryFile(std::string_view bytes)
      : fd_(memfd_create("fuzz", MFD_CLOEXEC)) {
    require(fchmod(fd_, 0600) == 0, "no file of its owner's alone");
    require(write(fd_, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()), "no memory for a file");
  }
  ~MemoryFile() { close(fd_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  std::string path() const { return "/proc/self/fd/" + std::to_string(fd_); }

 private:
  int fd_;
};

}  // namespace fuzz

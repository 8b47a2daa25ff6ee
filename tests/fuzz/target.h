// Interface of a fuzz target: a parser of foreign bytes, one FILE_fuzz.cpp each. The parser must return for all bytes;
// the sanitizers report reads and writes of memory that is not its own.
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

/// Prepares the target; called once before the others if the target defines it.
[[gnu::weak]] void begin(int argc, char** argv);

/// Returns inputs that the parser accepts, from which the fuzzer starts.
std::vector<std::string> seeds();

/// Parses the bytes. Returns whether the parser accepted them.
bool feed(std::string_view bytes);

/// Aborts with the message `what` unless `holds`.
inline void require(bool holds, const char* what) {
  if (holds) return;
  std::fputs(what, stderr);
  std::abort();
}

/// Returns the content of a file; "" if it cannot be read.
inline std::string fileText(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// A file in memory, for parsers that need a path. Aborts if it cannot be made. The path is valid while it lives.
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

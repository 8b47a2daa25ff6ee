// A disk that is slow to synchronise, and to open files whose names end in .toml (LD_PRELOAD). $TRACTION_SLOW_DISK
// names a file: it holds how long a call takes [s], or "hold": then it takes until the file says something else.
#include <dlfcn.h>
#include <fcntl.h>
#include <unistd.h>

#include <chrono>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <thread>

namespace {

template <typename Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

std::FILE* openPlainly(const char* path, const char* mode) {
  static const auto function = next<std::FILE*(const char*, const char*)>("fopen");
  return function(path, mode);
}

std::string wish() {
  static const char* const path = std::getenv("TRACTION_SLOW_DISK");
  std::string text(16, '\0');
  std::FILE* const file = path == nullptr ? nullptr : openPlainly(path, "r");
  text.resize(file == nullptr ? 0 : std::fread(text.data(), 1, text.size(), file));
  if (file != nullptr) std::fclose(file);
  return text;
}

void beSlow() {
  std::string now = wish();
  for (; now == "hold"; now = wish()) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  std::this_thread::sleep_for(std::chrono::duration<double>(std::strtod(now.c_str(), nullptr)));
}

}  // namespace

extern "C" int fsync(int file) {
  static const auto function = next<int(int)>("fsync");
  beSlow();
  return function(file);
}

extern "C" int fdatasync(int file) {
  static const auto function = next<int(int)>("fdatasync");
  beSlow();
  return function(file);
}

extern "C" int open(const char* path, int flags, ...) {
  static const auto function = next<int(const char*, int, ...)>("open");
  std::va_list rest;
  va_start(rest, flags);
  const mode_t mode = (flags & O_CREAT) == 0 ? 0 : va_arg(rest, mode_t);
  va_end(rest);
  if (std::string_view(path).ends_with(".toml")) beSlow();
  return function(path, flags, mode);
}

#include "base/service/own_directory.h"

#include "base/directory.h"
#include "proto/traction/v1/endpoints.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <system_error>
#include <utility>

namespace tractiond {
namespace {

namespace fs = std::filesystem;

tl::unexpected<Error> unusable(const std::string& what, const fs::path& path, int exitCode, const std::string& why) {
  return tl::unexpected(Error{.exitCode = exitCode,
                              .what = "the " + what + " " + path.string() + " cannot be used: " + why,
                              .remedy = "choose another with --" + what.substr(0, what.find(' '))});
}

tl::unexpected<Error> unusable(const std::string& what, const fs::path& path, int error) {
  const bool denied = error == EACCES || error == EPERM || error == EROFS;
  return unusable(what, path, denied ? EX_NOPERM : EX_CANTCREAT, std::generic_category().message(error));
}

}  // namespace

fs::path fromEnvironment(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value == '/' ? value : "";
}

fs::path runtimeDirectory(const std::string& instance, std::string_view program) {
  if (auto given = fromEnvironment("RUNTIME_DIRECTORY"); !given.empty()) return given;
  const auto candidates = traction::runtimeDirectories(instance, program);
  return geteuid() == 0 ? candidates.back() : candidates.front();
}

tl::expected<OwnDirectory, Error> OwnDirectory::claim(const fs::path& path, const std::string& what,
                                                      const std::string& program) {
  std::error_code failure;
  const bool made = fs::create_directories(path, failure);
  if (failure) return unusable(what, path, failure.value());
  const int descriptor = open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return unusable(what, path, errno);
  OwnDirectory directory(path, descriptor, made);
  struct stat own {};
  if (fstat(descriptor, &own) != 0 || canOthersControl(path, own)) {
    return unusable(what, path, EX_NOPERM,
                    "another user may control it, as every user can write into it or a directory above");
  }
  if (flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) return unusable(what, path, errno);
    return tl::unexpected(Error{.exitCode = EX_TEMPFAIL,
                                .what = "the " + what + " " + path.string() + " is in use by another " + program,
                                .remedy = "stop that one, or give this one a name with --instance"});
  }
  if (access(path.c_str(), W_OK) != 0) return unusable(what, path, errno);
  return directory;
}

OwnDirectory::OwnDirectory(fs::path path, int descriptor, bool made)
    : path_(std::move(path))
    , descriptor_(descriptor)
    , made_(made) {}

OwnDirectory::OwnDirectory(OwnDirectory&& other) noexcept
    : path_(std::move(other.path_))
    , descriptor_(std::exchange(other.descriptor_, -1))
    , made_(other.made_) {}

OwnDirectory::~OwnDirectory() {
  if (descriptor_ < 0) return;
  if (made_) rmdir(path_.c_str());  // fails if the directory is not empty
  close(descriptor_);
}

}  // namespace tractiond

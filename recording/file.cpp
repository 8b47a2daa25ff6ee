#include "recording/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <new>
#include <utility>

namespace recording {
namespace {

/// Size of one write. On kernels without preemption other tasks wait that long.
constexpr std::size_t kPiece = std::size_t{256} << 10;

}  // namespace

tl::expected<NewFile, Error> NewFile::create(const std::filesystem::path& path) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0666);
  if (fd < 0) {
    if (errno == EEXIST) {
      return tl::unexpected(
          Error{EX_CANTCREAT, "is there already, and what was recorded is not overwritten", path, "name another"});
    }
    return tl::unexpected(Error{EX_CANTCREAT, std::string("cannot be created: ") + std::strerror(errno), path});
  }
  static_cast<void>(tractiond::synchroniseNames(path.has_parent_path() ? path.parent_path() : "."));
  return NewFile(fd, path);
}

NewFile::NewFile(int file, std::filesystem::path path)
    : file_(file)
    , path_(std::move(path)) {}

Error NewFile::failure(int error) const {
  return {EX_IOERR, std::string("cannot be written: ") + std::strerror(error), path_};
}

tl::expected<void, Error> NewFile::append(std::string_view bytes, std::uint64_t reserve) {
  // File systems without fallocate report a lack of room only when writing.
  const int fd = file_.get();
  if (fallocate(fd, FALLOC_FL_KEEP_SIZE, static_cast<off_t>(size_), static_cast<off_t>(bytes.size() + reserve)) != 0 &&
      (errno == ENOSPC || errno == EDQUOT)) {
    return tl::unexpected(failure(errno));
  }
  for (std::string_view left = bytes; !left.empty();) {
    const ssize_t written = ::write(fd, left.data(), std::min(left.size(), kPiece));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      const int error = written < 0 ? errno : ENOSPC;
      truncate();
      return tl::unexpected(failure(error));
    }
    left.remove_prefix(static_cast<std::size_t>(written));
  }
  size_ += bytes.size();
  if (reserve == 0) truncate();
  return {};
}

void NewFile::truncate() {
  // Readers stop before a part of a record, and a file's reserved room is no error.
  [[maybe_unused]] const int failed = ::ftruncate(file_.get(), static_cast<off_t>(size_));
}

tl::expected<void, Error> NewFile::sync() {
  // EINVAL: a pipe has nothing to sync.
  if (fdatasync(file_.get()) != 0 && errno != EINVAL) return tl::unexpected(failure(errno));
  return {};
}

tl::expected<OldFile, Error> OldFile::open(const std::filesystem::path& path) {
  auto file = tractiond::openRegularFile(path);
  if (!file) {
    const bool isOther = file.error() == std::errc::not_supported;
    return tl::unexpected(
        Error{EX_NOINPUT, "cannot be read: " + (isOther ? "it is no file" : file.error().message()), path});
  }
  struct stat status {};
  fstat(file->get(), &status);
  return OldFile(*std::move(file), path, static_cast<std::uint64_t>(status.st_size));
}

OldFile::OldFile(tractiond::OpenFile file, std::filesystem::path path, std::uint64_t size)
    : file_(std::move(file))
    , path_(std::move(path))
    , size_(size) {}

tl::expected<void, Error> OldFile::read(std::uint64_t offset, std::uint64_t count, std::string& to) const {
  const auto failed = [&](const char* why) {
    to.clear();
    return tl::unexpected(Error{EX_IOERR, std::string("cannot be read: ") + why, path_});
  };
  if (offset > size_ || count > size_ - offset) return failed("it is shorter");
  try {
    to.resize(static_cast<std::size_t>(count));
  } catch (const std::bad_alloc&) {
    return failed("there is no memory for it");
  }
  for (std::size_t done = 0; done < to.size();) {
    const ssize_t got = pread(file_.get(), to.data() + done, to.size() - done, static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return failed(got < 0 ? std::strerror(errno) : "it has become shorter");
    done += static_cast<std::size_t>(got);
  }
  return {};
}

}  // namespace recording

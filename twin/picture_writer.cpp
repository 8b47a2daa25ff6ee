// Strategy. A pipe that poll() reports writable accepts PIPE_BUF bytes without blocking (POSIX). A picture is therefore
// written in pieces of that size, and `stop` is checked between them. Standard output is not made non-blocking, because
// that would affect every process that shares it.
#include "twin/picture_writer.h"

#include <fcntl.h>
#include <poll.h>
#include <sysexits.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstring>

namespace twin {
namespace {

constexpr int kLookForStop_ms = 50;

}  // namespace

tl::expected<std::unique_ptr<PictureWriter>, Failure> PictureWriter::open(const std::string& path,
                                                                          const std::atomic<bool>& stop) {
  if (path == "-") return std::unique_ptr<PictureWriter>(new PictureWriter(path, STDOUT_FILENO, stop));
  // Opening a pipe without a reader fails (ENXIO) rather than blocks, so that `stop` can be checked.
  int descriptor = -1;
  do {
    descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NONBLOCK, 0666);
  } while (descriptor < 0 && errno == ENXIO && !stop && poll(nullptr, 0, kLookForStop_ms) <= 0);
  if (descriptor < 0)
    return tl::unexpected(Failure{EX_CANTCREAT, "cannot write the pictures to " + path + ": " + std::strerror(errno)});
  return std::unique_ptr<PictureWriter>(new PictureWriter(path, descriptor, stop));
}

PictureWriter::PictureWriter(std::string path, int descriptor, const std::atomic<bool>& stop)
    : path_(std::move(path))
    , descriptor_(descriptor)
    , stop_(stop) {}

PictureWriter::~PictureWriter() {
  if (path_ != "-") close(descriptor_);
}

tl::expected<void, Failure> PictureWriter::write(std::span<const std::uint8_t> pixels) {
  while (!pixels.empty()) {
    pollfd item{descriptor_, POLLOUT, 0};
    const int ready = poll(&item, 1, kLookForStop_ms);
    if (stop_) return {};
    if (ready == 0 || (ready < 0 && errno == EINTR)) continue;
    const ssize_t written = ::write(descriptor_, pixels.data(), std::min<std::size_t>(pixels.size(), PIPE_BUF));
    if (written >= 0) {
      pixels = pixels.subspan(static_cast<std::size_t>(written));
    } else if (errno != EINTR && errno != EAGAIN) {
      const std::string where = path_ == "-" ? "standard output" : path_;
      return tl::unexpected(Failure{EX_IOERR, "cannot write the pictures to " + where + ": " + std::strerror(errno)});
    }
  }
  return {};
}

}  // namespace twin

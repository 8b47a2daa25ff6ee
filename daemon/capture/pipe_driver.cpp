// Strategy. A reader of its own is not needed: pop() itself reads into the next free buffer, as far as the pipe goes
// within the time allowed. While all buffers are out, nothing is read, and the writer waits.
#include "daemon/capture/pipe_driver.h"

#include "base/clock.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <thread>
#include <utility>
#include <vector>

namespace tractiond::capture {
namespace {

tl::unexpected<Error> failed(int exitCode, std::string what, std::string remedy = {}) {
  return tl::unexpected(Error{.exitCode = exitCode, .what = std::move(what), .remedy = std::move(remedy)});
}

class PipeDriver : public Driver {
 public:
  PipeDriver(int descriptor, const CameraOptions& options, const PixelFormatTraits& format)
      : descriptor_(descriptor)
      , path_(options.images)
      , interval_ns_(options.frameRate_Hz > 0.0 ? 1e9 / options.frameRate_Hz : 0.0) {
    info_.name.id = info_.name.model = "images";
    info_.name.vendor = "images";
    info_.name.address = options.images;
    info_.shape = {options.width, options.height, format.size(options.width, options.height), format.code()};
    info_.format = format.format;
    info_.triggered = true;  // pictures come as they come
    info_.frameRate_Hz = options.frameRate_Hz;
    buffers_.assign(static_cast<std::size_t>(options.buffers), std::vector<std::uint8_t>(info_.shape.size));
    for (auto& buffer : buffers_) free_.push_back(&buffer);
  }
  ~PipeDriver() override {
    if (path_ != "-") close(descriptor_);
  }

  const CameraInfo& info() const override { return info_; }
  Popped pop(Buffer& buffer, std::chrono::milliseconds timeout) override;
  void giveBack(void* handle) override {
    free_.push_back(static_cast<std::vector<std::uint8_t>*>(handle));
    if (filled_ > 0) std::swap(free_.back(), free_[free_.size() - 2]);  // the picture under way stays last
  }
  /// There is one session: nothing is given back after it but what dies with it.
  Discard discard() const override {
    return [](void*) {};
  }
  Error end() const override { return end_; }

 private:
  void handOn(std::vector<std::uint8_t>& picture, Buffer& buffer);

  int descriptor_;
  std::string path_;
  double interval_ns_;  ///< from picture to picture
  CameraInfo info_;
  std::vector<std::vector<std::uint8_t>> buffers_;
  std::vector<std::vector<std::uint8_t>*> free_;  ///< never grows beyond its first size
  std::size_t filled_ = 0;                        ///< bytes of the picture under way, in the last free buffer
  std::uint64_t count_ = 0;
  std::int64_t first_ns_ = 0;  ///< when the first picture was handed on
  Error end_{.exitCode = EX_OK};
};

Popped PipeDriver::pop(Buffer& buffer, std::chrono::milliseconds timeout) {
  const std::int64_t until_ns = monotonicNow() + std::chrono::nanoseconds(timeout).count();
  while (!free_.empty()) {
    std::vector<std::uint8_t>& picture = *free_.back();
    if (filled_ == picture.size()) {
      const std::int64_t now_ns = monotonicNow();
      if (count_ == 0) first_ns_ = now_ns;
      const std::int64_t due_ns = first_ns_ + static_cast<std::int64_t>(static_cast<double>(count_) * interval_ns_);
      if (now_ns >= due_ns) {
        handOn(picture, buffer);
        return Popped::kBuffer;
      }
      if (now_ns >= until_ns) return Popped::kNothing;
      std::this_thread::sleep_for(std::chrono::nanoseconds(std::min(due_ns, until_ns) - now_ns));
      continue;
    }
    pollfd item{descriptor_, POLLIN, 0};
    const std::int64_t left_ms = std::max<std::int64_t>(0, (until_ns - monotonicNow()) / 1'000'000);
    const int ready = poll(&item, 1, static_cast<int>(left_ms));
    if (ready == 0 || (ready < 0 && errno == EINTR)) return Popped::kNothing;
    const ssize_t got = read(descriptor_, picture.data() + filled_, picture.size() - filled_);
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) continue;
    if (got <= 0) {
      const std::string of = path_ == "-" ? "standard input" : path_;
      if (got < 0)
        end_ = {
            .exitCode = EX_IOERR, .what = "pictures cannot be read: " + std::string(std::strerror(errno)), .where = of};
      else if (filled_ > 0)
        end_ = {.exitCode = EX_DATAERR,
                .what = "the pictures end within number " + std::to_string(count_ + 1) + ": " +
                        std::to_string(filled_) + " of " + std::to_string(picture.size()) + " bytes",
                .where = of,
                .remedy = "camera.width_px, height_px and pixel_format must be those of the pictures"};
      else if (count_ == 0)
        end_ = {.exitCode = EX_DATAERR,
                .what = "the pictures end before the first one",
                .where = of,
                .remedy = "does what writes them run, and without an error?"};
      return Popped::kEnd;
    }
    filled_ += static_cast<std::size_t>(got);
  }
  poll(nullptr, 0, static_cast<int>(std::max<std::int64_t>(0, (until_ns - monotonicNow()) / 1'000'000)));
  return Popped::kNothing;
}

void PipeDriver::handOn(std::vector<std::uint8_t>& picture, Buffer& buffer) {
  free_.pop_back();
  filled_ = 0;
  buffer.arrival.complete = true;
  buffer.arrival.shape = info_.shape;
  buffer.arrival.id = ++count_;
  buffer.arrival.host_ns = monotonicNow();
  buffer.arrival.device_ns = 0;  // the time of exposure is unknown
  buffer.data = picture.data();
  buffer.stride = traitsOf(info_.format).stride(info_.shape.width);
  buffer.awaited = true;
  buffer.handle = &picture;
}

}  // namespace

OpenDriver fromPipe(const CameraOptions& options) {
  return [options](const Opening& /*opening*/) -> tl::expected<std::unique_ptr<Driver>, Error> {
    const PixelFormatTraits* format = pixelFormatByName(options.pixelFormat);
    if (format == nullptr || options.width <= 0 || options.height <= 0)
      return failed(EX_CONFIG, "pictures from a pipe do not say what they are",
                    "set camera.width_px, camera.height_px and camera.pixel_format");
    // Without O_NONBLOCK, opening a named pipe waits for its writer and cannot be stopped; pop() waits instead.
    constexpr int kFlags = O_RDONLY | O_CLOEXEC | O_NONBLOCK;
    const int descriptor = options.images == "-" ? STDIN_FILENO : open(options.images.c_str(), kFlags);
    if (descriptor < 0)
      return failed(EX_NOINPUT, "the pictures " + options.images + " cannot be opened: " + std::strerror(errno));
    return std::make_unique<PipeDriver>(descriptor, options, *format);
  };
}

}  // namespace tractiond::capture

// The only file that uses Aravis. Before Aravis 0.8.26 calls fill(), it increments the frame id (16 bit, 65535 is
// followed by 1) and stamps the buffer with the wall clock; both are sent as they are in the buffer. It paces by the
// wall clock: a frame is due at every whole multiple of the frame period.
#include "twin/gv_camera.h"

#include "base/aravis_versions.h"
#include "base/clock.h"

#include <arpa/inet.h>
#include <arv.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace twin {

namespace {

constexpr const char* kVendor = "Traction";
constexpr const char* kModel = "Twin";

// Bootstrap registers of the GigE Vision specification: address and size of a string.
struct TextRegister {
  guint32 address, size;
};
constexpr TextRegister kVendorRegister{0x48, 32}, kModelRegister{0x68, 32};

void writeText(ArvFakeCamera* camera, const TextRegister& where, const char* text) {
  std::vector<char> padded(where.size, '\0');
  std::strncpy(padded.data(), text, where.size - 1);
  arv_fake_camera_write_memory(camera, where.address, where.size, padded.data());
}

/// Returns whether the camera could listen: Aravis starts beside another one on the same address, and takes its
/// packets.
bool canListen(const std::string& address) {
  constexpr std::uint16_t kControlPort = 3956;
  sockaddr_in wanted{};
  wanted.sin_family = AF_INET;
  wanted.sin_port = htons(kControlPort);
  if (inet_pton(AF_INET, address.c_str(), &wanted.sin_addr) != 1) return false;
  const int probe = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const bool can = probe >= 0 && bind(probe, reinterpret_cast<const sockaddr*>(&wanted), sizeof wanted) == 0;
  if (probe >= 0) close(probe);
  return can;
}

}  // namespace

tl::expected<std::unique_ptr<GvCamera>, tractiond::Error> GvCamera::open(const GvCameraOptions& options) {
  if (canListen(options.address)) {
    std::unique_ptr<GvCamera> camera(new GvCamera(options));
    if (arv_gv_fake_camera_is_running(ARV_GV_FAKE_CAMERA(camera->camera_)) != 0) return camera;
  }
  // Aravis does not say why; every address of 127.0.0.0/8 can be bound, but it requires an interface with exactly this
  // one.
  return tl::unexpected(tractiond::Error{
      .exitCode = EX_UNAVAILABLE,
      .what = "no camera starts on " + options.address,
      .remedy =
          "it must be an IPv4 address of an interface that is up ('ip address add " + options.address +
          "/8 dev lo' gives it to the loopback), and port 3956 free on it (another twin takes --address 127.0.0.2, "
          "say) and on 255.255.255.255"});
}

GvCamera::GvCamera(const GvCameraOptions& options)
    : width_(options.width)
    , height_(options.height)
    , format_(options.format)
    , period_us_(static_cast<std::uint32_t>(std::lround(1e6 / options.rate_hz))) {
  std::string serial = options.address;
  std::replace(serial.begin(), serial.end(), '.', '-');
  id_ = std::string(kVendor) + "-" + serial;
  const std::lock_guard lock(mutex_);  // Aravis's thread starts at once, but first calls fill() after this function
  camera_ = g_object_new(ARV_TYPE_GV_FAKE_CAMERA, "interface-name", options.address.c_str(), "serial-number",
                         serial.c_str(), "gvsp-lost-ratio", options.lostRatio, nullptr);
  ArvFakeCamera* fake = arv_gv_fake_camera_get_fake_camera(ARV_GV_FAKE_CAMERA(camera_));
  writeText(fake, kVendorRegister, kVendor);
  writeText(fake, kModelRegister, kModel);
  const auto set = [fake](guint32 address, auto value) {
    arv_fake_camera_write_register(fake, address, static_cast<guint32>(value));
  };
  set(ARV_FAKE_CAMERA_REGISTER_SENSOR_WIDTH, width_);
  set(ARV_FAKE_CAMERA_REGISTER_SENSOR_HEIGHT, height_);
  set(ARV_FAKE_CAMERA_REGISTER_WIDTH, width_);
  set(ARV_FAKE_CAMERA_REGISTER_HEIGHT, height_);
  set(ARV_FAKE_CAMERA_REGISTER_PIXEL_FORMAT, traitsOf(format_).code());
  set(ARV_FAKE_CAMERA_REGISTER_ACQUISITION_FRAME_PERIOD_US, period_us_);
  tractiond::aravis::setFillPattern(
      fake,
      [](ArvBuffer* buffer, void* self, guint32 /*exposure_us*/, guint32 /*gain*/, ArvPixelFormat format) {
        static_cast<GvCamera*>(self)->fill(buffer, format);
      },
      this);
}

GvCamera::~GvCamera() {
  {
    const std::lock_guard lock(mutex_);
    isClosing_ = true;
  }
  changed_.notify_all();
  close();
}

void GvCamera::close() {
  if (camera_ != nullptr) g_object_unref(camera_);  // joins Aravis's thread, which uses the camera until then
  camera_ = nullptr;
}

Format GvCamera::format() const {
  const std::lock_guard lock(mutex_);
  return format_;
}

double GvCamera::framePeriod_s() const {
  const std::lock_guard lock(mutex_);
  return period_us_ * 1e-6;
}

void GvCamera::queue(Picture& picture) {
  {
    const std::lock_guard lock(mutex_);
    picture.stamp.reset();
    // A picture drawn before the client chose another format cannot be sent.
    (picture.format == format_ ? queued_ : returned_).push_back(&picture);
  }
  changed_.notify_all();
}

Picture* GvCamera::takeBack(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  if (!changed_.wait_for(lock, timeout, [this] { return !returned_.empty(); })) return nullptr;
  Picture* picture = returned_.front();
  returned_.pop_front();
  return picture;
}

void GvCamera::fill(void* given, std::uint32_t pixelFormat) {
  ArvBuffer* const buffer = ARV_BUFFER(given);
  // Aravis supplies the memory, but reports its size as zero at this point.
  std::size_t unknown = 0;
  auto* to = static_cast<std::uint8_t*>(const_cast<void*>(arv_buffer_get_data(buffer, &unknown)));
  const Format format{pixelFormat};
  const int width = arv_buffer_get_image_width(buffer), height = arv_buffer_get_image_height(buffer);
  if (std::ranges::find(formats(), format) == formats().end()) {
    const auto bits = ARV_PIXEL_FORMAT_BIT_PER_PIXEL(pixelFormat);
    std::memset(to, 0, static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * bits / 8);
    return;
  }
  const Picture* picture = waitFor(format);
  if (!picture) return;
  copyRegion(*picture, arv_buffer_get_image_x(buffer), arv_buffer_get_image_y(buffer), width, height, to);
  sent({arv_buffer_get_frame_id(buffer), static_cast<std::int64_t>(arv_buffer_get_timestamp(buffer)),
        tractiond::monotonicNow()});
}

/// Returns the next picture, which stays in the queue; null when the camera closes.
const Picture* GvCamera::waitFor(Format format) {
  std::unique_lock lock(mutex_);
  guint32 period_us = 0;
  arv_fake_camera_read_register(arv_gv_fake_camera_get_fake_camera(ARV_GV_FAKE_CAMERA(camera_)),
                                ARV_FAKE_CAMERA_REGISTER_ACQUISITION_FRAME_PERIOD_US, &period_us);
  if (period_us > 0) period_us_ = period_us;
  if (format != format_) {
    format_ = format;
    returned_.insert(returned_.end(), queued_.begin(), queued_.end());
    queued_.clear();
    changed_.notify_all();
  }
  changed_.wait(lock, [this] { return isClosing_ || !queued_.empty(); });
  return isClosing_ ? nullptr : queued_.front();
}

void GvCamera::sent(const Stamp& stamp) {
  {
    const std::lock_guard lock(mutex_);
    queued_.front()->stamp = stamp;
    returned_.push_back(queued_.front());
    queued_.pop_front();
  }
  changed_.notify_all();
}

/// Copies the region of interest that the client has chosen, in whole bytes.
void GvCamera::copyRegion(const Picture& picture, int x, int y, int width, int height, std::uint8_t* to) const {
  if (x == 0 && y == 0 && width == width_ && height == height_) {  // rows may begin within bytes
    std::memcpy(to, picture.pixels.data(), picture.pixels.size());
    return;
  }
  const int columns = std::clamp(width_ - x, 0, width), rows = std::clamp(height_ - y, 0, height);
  const auto bytes = [&](int pixels) { return traitsOf(picture.format).size(pixels, 1); };
  const std::size_t stride = bytes(width_), rowSize = bytes(width), copied = bytes(columns);
  for (int row = 0; row < height; ++row, to += rowSize) {
    const std::size_t from = row < rows ? static_cast<std::size_t>(y + row) * stride + bytes(x) : 0;
    const std::size_t size = row < rows ? copied : 0;
    std::memcpy(to, picture.pixels.data() + from, size);
    std::memset(to + size, 0, rowSize - size);
  }
}

}  // namespace twin

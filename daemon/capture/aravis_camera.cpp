// Strategy. A Session is one opened camera: found, controlled, set, read back, streaming, its packet size proved by a
// whole frame. next() only pops, judges and hands on. When the camera falls silent or says that control is lost, the
// session goes to the keeper's thread, which closes it and opens another until one is good; next() takes that over.
// A buffer that was out while its stream died carries the number of its session, and is freed instead of returned.
#include "daemon/capture/aravis_camera.h"

#include "daemon/base/clock.h"

#include <arpa/inet.h>
#include <arv.h>
#include <dirent.h>
#include <ifaddrs.h>
#include <linux/if_ether.h>
#include <net/if.h>
#include <netinet/in.h>
#include <pthread.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <thread>
#include <utility>

namespace tractiond::capture {
namespace {

using std::chrono::milliseconds;

struct Unref {
  void operator()(void* object) const { g_object_unref(object); }
};
template <class T>
using Ref = std::unique_ptr<T, Unref>;

/// A GError that is freed; into() is the last argument of Aravis's functions.
class Failure {
 public:
  Failure() = default;
  Failure(const Failure&) = delete;
  Failure& operator=(const Failure&) = delete;
  ~Failure() { g_clear_error(&error_); }
  GError** into() {
    g_clear_error(&error_);
    return &error_;
  }
  explicit operator bool() const { return error_ != nullptr; }
  std::string text() const { return error_ == nullptr ? "unknown error" : error_->message; }

 private:
  GError* error_ = nullptr;
};

std::string text(const char* string) {
  return string == nullptr ? "" : string;
}

std::string number(double value) {
  std::array<char, 32> digits{};
  std::snprintf(digits.data(), digits.size(), "%.10g", value);
  return digits.data();
}

std::string joined(const std::vector<std::string>& items) {
  std::string all;
  for (const std::string& item : items) all += (all.empty() ? "" : ", ") + item;
  return all;
}

/// Frees Aravis's arrays of borrowed strings.
std::vector<std::string> taken(const char** names, guint count) {
  std::vector<std::string> all;
  for (guint i = 0; names != nullptr && i < count; ++i) all.emplace_back(text(names[i]));
  g_free(names);
  return all;
}

struct KnownFormat {
  const char* name;
  ArvPixelFormat code;
  PixelFormat format;
  int bytesPerPixel;
};
const std::array<KnownFormat, 6> kFormats{{
    {"RGB8", ARV_PIXEL_FORMAT_RGB_8_PACKED, PixelFormat::kRgb8, 3},
    {"BGR8", ARV_PIXEL_FORMAT_BGR_8_PACKED, PixelFormat::kBgr8, 3},
    {"BayerRG8", ARV_PIXEL_FORMAT_BAYER_RG_8, PixelFormat::kBayerRG8, 1},
    {"BayerGR8", ARV_PIXEL_FORMAT_BAYER_GR_8, PixelFormat::kBayerGR8, 1},
    {"BayerGB8", ARV_PIXEL_FORMAT_BAYER_GB_8, PixelFormat::kBayerGB8, 1},
    {"BayerBG8", ARV_PIXEL_FORMAT_BAYER_BG_8, PixelFormat::kBayerBG8, 1},
}};

const KnownFormat* knownFormat(ArvPixelFormat code) {
  const auto* found = std::find_if(kFormats.begin(), kFormats.end(), [&](const auto& f) { return f.code == code; });
  return found == kFormats.end() ? nullptr : found;
}

tl::unexpected<Error> failed(int exitCode, std::string what, std::string remedy = {}) {
  return tl::unexpected(Error{exitCode, std::move(what), "camera", std::move(remedy)});
}

// ---------------------------------------------------------------- finding

CameraName nameInList(unsigned index) {
  return {text(arv_get_device_id(index)),      text(arv_get_device_physical_id(index)),
          text(arv_get_device_address(index)), text(arv_get_device_vendor(index)),
          text(arv_get_device_model(index)),   text(arv_get_device_serial_nbr(index)),
          text(arv_get_device_protocol(index))};
}

bool isAddress(const std::string& id) {
  in_addr address{};
  return inet_pton(AF_INET, id.c_str(), &address) == 1;
}

bool matches(const CameraName& name, const std::string& id) {
  const auto same = [&](const std::string& other) { return g_ascii_strcasecmp(other.c_str(), id.c_str()) == 0; };
  return same(name.id) || same(name.physicalId) || same(name.address) || same(name.vendor + "-" + name.serial);
}

/// Looks in the list first: Aravis itself would ask the name server for an unknown id.
tl::expected<Ref<ArvCamera>, Error> connect(const CameraOptions& options) {
  if (options.fakeInterface) arv_enable_interface("Fake");
  std::string id = options.id;
  if (!id.empty() && !isAddress(id)) {
    const std::vector<CameraName> all = listCameras(options.fakeInterface);
    const auto found = std::find_if(all.begin(), all.end(), [&](const CameraName& c) { return matches(c, id); });
    if (found == all.end()) {
      std::vector<std::string> ids;
      for (const CameraName& camera : all) ids.push_back(camera.id);
      return failed(EX_UNAVAILABLE, "there is no camera \"" + id + "\"",
                    ids.empty() ? "no camera answers" : "there are: " + joined(ids));
    }
    // Twins of one id are told apart by their addresses.
    id = isAddress(found->address) ? found->address : found->id;
  }
  Failure failure;
  Ref<ArvCamera> camera(arv_camera_new(id.empty() ? nullptr : id.c_str(), failure.into()));
  if (!camera)
    return failed(EX_UNAVAILABLE,
                  options.id.empty() ? "no camera answers" : "camera \"" + options.id + "\" does not answer",
                  failure.text());
  return camera;
}

CameraName nameOf(ArvCamera* camera) {
  CameraName name;
  name.vendor = text(arv_camera_get_vendor_name(camera, nullptr));
  name.model = text(arv_camera_get_model_name(camera, nullptr));
  name.serial = text(arv_camera_get_device_serial_number(camera, nullptr));
  name.id = name.vendor + "-" + name.model + "-" + name.serial;
  name.protocol = arv_camera_is_gv_device(camera)   ? "GigEVision"
                  : arv_camera_is_uv_device(camera) ? "USB3Vision"
                                                    : "Fake";
  if (arv_camera_is_gv_device(camera)) {
    auto* address =
        G_INET_SOCKET_ADDRESS(arv_gv_device_get_device_address(ARV_GV_DEVICE(arv_camera_get_device(camera))));
    char* dotted = g_inet_address_to_string(g_inet_socket_address_get_address(address));
    name.address = text(dotted);
    g_free(dotted);
  }
  return name;
}

// ---------------------------------------------------------------- setting

std::string written(const Feature& feature) {
  struct {
    std::string operator()(bool value) const { return value ? "true" : "false"; }
    std::string operator()(std::int64_t value) const { return std::to_string(value); }
    std::string operator()(double value) const { return number(value); }
    std::string operator()(const std::string& value) const { return value; }
  } spell;
  return std::visit(spell, feature.value);
}

/// Writes the settings and keeps what the camera made of them.
class Setter {
 public:
  Setter(ArvCamera* camera, CameraInfo& info)
      : camera_(camera)
      , device_(arv_camera_get_device(camera))
      , info_(info) {}

  tl::expected<void, Error> apply(const CameraOptions& options);

 private:
  using Result = tl::expected<void, Error>;

  Result set(const Feature& feature);
  Result refuse(const Feature& feature, const std::string& why, const std::string& remedy = {}) const {
    return failed(EX_CONFIG, "the camera refuses " + feature.name + " = " + written(feature) + ": " + why, remedy);
  }
  Result finish(const std::string& name, double asked, double got, const Failure& failure);
  Result finish(const Feature& feature, const std::string& got);
  template <class Set, class Get>
  Result helper(const char* name, double value, Set write, Get read);

  ArvCamera* camera_;
  ArvDevice* device_;
  CameraInfo& info_;
};

Setter::Result Setter::finish(const std::string& name, double asked, double got, const Failure& failure) {
  if (failure) return failed(EX_CONFIG, "the camera refuses " + name + " = " + number(asked) + ": " + failure.text());
  const double off = std::abs(got - asked);
  const bool rounded = off > 1e-9 * std::abs(asked);
  info_.settings.push_back(name + " = " + number(got) + (rounded ? " (asked: " + number(asked) + ")" : ""));
  if (off > 0.01 * std::abs(asked))
    info_.warnings.push_back("the camera set " + name + " to " + number(got) + " instead of " + number(asked));
  return {};
}

Setter::Result Setter::finish(const Feature& feature, const std::string& got) {
  if (got != written(feature)) return refuse(feature, "it still says " + got);
  info_.settings.push_back(feature.name + " = " + got);
  return {};
}

template <class Set, class Get>
Setter::Result Setter::helper(const char* name, double value, Set write, Get read) {
  Failure failure;
  write(camera_, value, failure.into());
  const double got = failure ? 0.0 : read(camera_, failure.into());
  return finish(name, value, got, failure);
}

Setter::Result Setter::set(const Feature& feature) {
  const char* name = feature.name.c_str();
  ArvGcNode* node = arv_device_get_feature(device_, name);
  if (node == nullptr || !ARV_IS_GC_FEATURE_NODE(node))
    return failed(EX_CONFIG, "the camera has no feature " + feature.name, "see what \"arv-tool-0.8 features\" lists");
  Failure failure;
  if (!arv_gc_feature_node_is_available(ARV_GC_FEATURE_NODE(node), failure.into()))
    return refuse(feature, "it is not available", "the order of the features may matter");
  if (arv_gc_feature_node_is_locked(ARV_GC_FEATURE_NODE(node), failure.into()))
    return refuse(feature, "it is locked", "the order of the features may matter");

  const bool* flag = std::get_if<bool>(&feature.value);
  const std::int64_t* integer = std::get_if<std::int64_t>(&feature.value);
  const std::string* string = std::get_if<std::string>(&feature.value);
  const double* real = std::get_if<double>(&feature.value);

  if (ARV_IS_GC_COMMAND(node)) {
    if (flag == nullptr || !*flag) return refuse(feature, "it is a command", "write " + feature.name + " = true");
    arv_device_execute_command(device_, name, failure.into());
    if (failure) return refuse(feature, failure.text());
    info_.settings.push_back(feature.name + " executed");
    return {};
  }
  if (ARV_IS_GC_BOOLEAN(node)) {
    if (flag == nullptr) return refuse(feature, "it is true or false");
    arv_device_set_boolean_feature_value(device_, name, *flag, failure.into());
    if (failure) return refuse(feature, failure.text());
    const bool got = arv_device_get_boolean_feature_value(device_, name, failure.into());
    return failure ? refuse(feature, failure.text()) : finish(feature, got ? "true" : "false");
  }
  if (ARV_IS_GC_ENUMERATION(node)) {
    guint count = 0;
    const char** entries =
        arv_device_dup_available_enumeration_feature_values_as_strings(device_, name, &count, failure.into());
    const std::vector<std::string> offered = taken(entries, count);
    if (string == nullptr || std::find(offered.begin(), offered.end(), *string) == offered.end())
      return refuse(feature, "it is one of " + joined(offered));
    arv_device_set_string_feature_value(device_, name, string->c_str(), failure.into());
    if (failure) return refuse(feature, failure.text());
    const std::string got = text(arv_device_get_string_feature_value(device_, name, failure.into()));
    return failure ? refuse(feature, failure.text()) : finish(feature, got);
  }
  if (ARV_IS_GC_FLOAT(node) && !ARV_IS_GC_INTEGER(node)) {
    if (real == nullptr && integer == nullptr) return refuse(feature, "it is a number");
    const double value = real != nullptr ? *real : static_cast<double>(*integer);
    double low = 0, high = 0;
    arv_device_get_float_feature_bounds(device_, name, &low, &high, failure.into());
    if (!failure && (value < low || value > high))
      return refuse(feature, "it may be " + number(low) + " to " + number(high));
    arv_device_set_float_feature_value(device_, name, value, failure.into());
    if (failure) return refuse(feature, failure.text());
    const double got = arv_device_get_float_feature_value(device_, name, failure.into());
    return finish(feature.name, value, got, failure);
  }
  if (ARV_IS_GC_INTEGER(node)) {
    if (integer == nullptr) return refuse(feature, "it is a whole number");
    gint64 low = 0, high = 0;
    arv_device_get_integer_feature_bounds(device_, name, &low, &high, failure.into());
    if (!failure && (*integer < low || *integer > high))
      return refuse(feature, "it may be " + std::to_string(low) + " to " + std::to_string(high));
    arv_device_set_integer_feature_value(device_, name, *integer, failure.into());
    if (failure) return refuse(feature, failure.text());
    const gint64 got = arv_device_get_integer_feature_value(device_, name, failure.into());
    return finish(feature.name, static_cast<double>(*integer), static_cast<double>(got), failure);
  }
  if (ARV_IS_GC_STRING(node)) {
    if (string == nullptr) return refuse(feature, "it is a text");
    arv_device_set_string_feature_value(device_, name, string->c_str(), failure.into());
    if (failure) return refuse(feature, failure.text());
    const std::string got = text(arv_device_get_string_feature_value(device_, name, failure.into()));
    return failure ? refuse(feature, failure.text()) : finish(feature, got);
  }
  return refuse(feature, "a feature of this kind cannot be written");
}

Setter::Result Setter::apply(const CameraOptions& options) {
  std::vector<Feature> first;
  if (!options.pixelFormat.empty()) first.push_back({"PixelFormat", options.pixelFormat});
  if (options.width > 0) first.push_back({"Width", std::int64_t{options.width}});
  if (options.height > 0) first.push_back({"Height", std::int64_t{options.height}});
  Result result;
  for (std::size_t i = 0; result && i < first.size(); ++i) result = set(first[i]);
  // Sets what belongs to it as well, and clears triggers: before the features.
  if (result && options.frameRate_Hz > 0)
    result = helper("the frame rate", options.frameRate_Hz, arv_camera_set_frame_rate, arv_camera_get_frame_rate);
  if (result && options.exposure_us > 0)
    result =
        helper("the exposure time", options.exposure_us, arv_camera_set_exposure_time, arv_camera_get_exposure_time);
  if (result && options.gain) result = helper("the gain", *options.gain, arv_camera_set_gain, arv_camera_get_gain);
  for (std::size_t i = 0; result && i < options.features.size(); ++i) result = set(options.features[i]);
  return result;
}

/// The picture as it will be sent, after all settings.
tl::expected<PictureShape, Error> readPicture(ArvCamera* camera, CameraInfo& info) {
  Failure failure;
  const ArvPixelFormat code = arv_camera_get_pixel_format(camera, failure.into());
  if (failure) return failed(EX_UNAVAILABLE, "the camera does not tell its pixel format", failure.text());
  const KnownFormat* known = knownFormat(code);
  if (known == nullptr) {
    guint count = 0;
    const char** names = arv_camera_dup_available_pixel_formats_as_strings(camera, &count, failure.into());
    const std::vector<std::string> offered = taken(names, count);
    std::vector<std::string> usable;
    for (const KnownFormat& format : kFormats)
      if (std::find(offered.begin(), offered.end(), format.name) != offered.end()) usable.emplace_back(format.name);
    return failed(EX_CONFIG,
                  "the camera sends " + text(arv_camera_get_pixel_format_as_string(camera, failure.into())) +
                      ", which cannot be read; it offers " + joined(offered),
                  usable.empty() ? "another camera is needed: RGB8, BGR8 or 8-bit Bayer"
                                 : "set camera.pixel_format to " + usable.front());
  }
  gint x = 0, y = 0, width = 0, height = 0;
  arv_camera_get_region(camera, &x, &y, &width, &height, failure.into());
  if (failure || width <= 0 || height <= 0)
    return failed(EX_UNAVAILABLE, "the camera does not tell the size of its picture", failure.text());
  info.width = width;
  info.height = height;
  info.format = known->format;
  info.frameRate_Hz =
      arv_camera_is_frame_rate_available(camera, nullptr) ? arv_camera_get_frame_rate(camera, nullptr) : 0.0;
  info.exposure_s = arv_camera_is_exposure_time_available(camera, nullptr)
                        ? arv_camera_get_exposure_time(camera, nullptr) * 1e-6
                        : 0.0;
  PictureShape shape;
  shape.width = width;
  shape.height = height;
  shape.size = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
               static_cast<std::size_t>(known->bytesPerPixel);
  shape.format = code;
  return shape;
}

// ---------------------------------------------------------------- network

/// 0: not known.
int mtuOf(ArvGvDevice* device) {
  auto* socketAddress = G_INET_SOCKET_ADDRESS(arv_gv_device_get_interface_address(device));
  in_addr wanted{};
  std::memcpy(&wanted, g_inet_address_to_bytes(g_inet_socket_address_get_address(socketAddress)), sizeof wanted);
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) return 0;
  ifreq request{};
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
    sockaddr_in address{};
    std::memcpy(&address, one->ifa_addr, sizeof address);
    if (address.sin_addr.s_addr == wanted.s_addr) std::strncpy(request.ifr_name, one->ifa_name, IFNAMSIZ - 1);
  }
  freeifaddrs(all);
  const int probe = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const bool known = probe >= 0 && request.ifr_name[0] != '\0' && ioctl(probe, SIOCGIFMTU, &request) == 0;
  if (probe >= 0) close(probe);
  return known ? request.ifr_mtu : 0;
}

/// Aravis hides its socket; among our own descriptors it is the one with the stream's port. -1: not found.
int streamSocket(ArvStream* stream) {
  const std::uint16_t port = arv_gv_stream_get_port(ARV_GV_STREAM(stream));
  DIR* folder = opendir("/proc/self/fd");
  int found = -1;
  for (const dirent* entry = nullptr; folder != nullptr && found < 0 && (entry = readdir(folder)) != nullptr;) {
    const int descriptor = std::atoi(entry->d_name);
    sockaddr_in address{};
    socklen_t length = sizeof address;
    int type = 0;
    socklen_t typeLength = sizeof type;
    if (entry->d_name[0] != '.' && getsockopt(descriptor, SOL_SOCKET, SO_TYPE, &type, &typeLength) == 0 &&
        type == SOCK_DGRAM && getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &length) == 0 &&
        address.sin_family == AF_INET && ntohs(address.sin_port) == port)
      found = descriptor;
  }
  if (folder != nullptr) closedir(folder);
  return found;
}

/// Aravis sets the size with the first packet only, and that frame would be lost already. Returns what was granted.
int setReceiveBuffer(ArvStream* stream, int size_bytes) {
  g_object_set(stream, "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size", size_bytes, nullptr);
  const int descriptor = streamSocket(stream);
  if (descriptor < 0) return 0;
  setsockopt(descriptor, SOL_SOCKET, SO_RCVBUF, &size_bytes, sizeof size_bytes);
  int doubled = 0;  // the kernel reports twice what it was asked for
  socklen_t length = sizeof doubled;
  return getsockopt(descriptor, SOL_SOCKET, SO_RCVBUF, &doubled, &length) == 0 ? doubled / 2 : 0;
}

/// The test that Aravis itself makes.
bool packetSocketAllowed() {
  const int probe = socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, htons(ETH_P_ALL));
  if (probe >= 0) close(probe);
  return probe >= 0;
}

/// From the largest to the safest.
tl::expected<std::vector<int>, Error> packetSizes(ArvCamera* camera, const CameraOptions& options) {
  constexpr int kJumbo = 9000, kEthernet = 1500, kAnyNetwork = 576;
  const int mtu = mtuOf(ARV_GV_DEVICE(arv_camera_get_device(camera)));
  if (options.packetSize_bytes > 0) {
    if (mtu > 0 && options.packetSize_bytes > mtu)
      return failed(EX_CONFIG,
                    "camera.packet_size_bytes = " + std::to_string(options.packetSize_bytes) +
                        " is above the MTU of the camera's interface, " + std::to_string(mtu),
                    "set it to 0, or raise the MTU");
    return std::vector<int>{options.packetSize_bytes};
  }
  int largest = mtu > 0 ? std::min(mtu, kJumbo) : kEthernet;
  ArvDevice* device = arv_camera_get_device(camera);
  Failure failure;
  gint64 low = 0, high = 0;
  arv_device_get_integer_feature_bounds(device, "GevSCPSPacketSize", &low, &high, failure.into());
  if (!failure && high > 0) largest = static_cast<int>(std::min<gint64>(largest, high));
  if (arv_device_get_feature(device, "GevSCPSFireTestPacket") != nullptr) {
    const guint tested = arv_camera_gv_auto_packet_size(camera, failure.into());
    if (!failure && tested >= kAnyNetwork) largest = std::min(largest, static_cast<int>(tested));
  }
  std::vector<int> sizes{largest - largest % 4};
  for (const int safe : {kEthernet, kAnyNetwork})
    if (safe < sizes.back()) sizes.push_back(safe);
  return sizes;
}

}  // namespace

// ---------------------------------------------------------------- session

struct AravisCamera::Session {
  std::atomic<bool> controlLost{false};  // set by Aravis's heartbeat thread: outlives the camera
  Ref<ArvCamera> camera;
  Ref<ArvStream> stream;
  CameraInfo info;
  PictureShape shape;
  std::uintptr_t number = 0;  // of the session; its buffers carry it
  bool silent = false;

  static tl::expected<std::unique_ptr<Session>, Error> open(const CameraOptions& options);
  ~Session();

  tl::expected<void, Error> startStream(const CameraOptions& options);
  tl::expected<void, Error> stream_(const CameraOptions& options, int packetSize_bytes);
  enum class Proof { kWhole, kBroken, kNothing };
  Proof firstFrame() const;
};

AravisCamera::Session::~Session() {
  // Each call to a dead camera blocks for 2.5 s: the first may be spared.
  if (stream && !silent && !controlLost) arv_camera_stop_acquisition(camera.get(), nullptr);
  stream.reset();
  camera.reset();
}

tl::expected<std::unique_ptr<AravisCamera::Session>, Error> AravisCamera::Session::open(const CameraOptions& options) {
  static std::atomic<std::uintptr_t> sessions{0};
  auto session = std::make_unique<Session>();
  session->number = ++sessions;
  auto connected = connect(options);
  if (!connected) return tl::unexpected(connected.error());
  session->camera = std::move(*connected);
  ArvCamera* camera = session->camera.get();
  ArvDevice* device = arv_camera_get_device(camera);
  session->info.name = nameOf(camera);

  if (ARV_IS_GV_DEVICE(device) && !arv_gv_device_is_controller(ARV_GV_DEVICE(device)))
    return failed(EX_TEMPFAIL,
                  "camera " + session->info.name.id + " at " + session->info.name.address +
                      " is held by another client",
                  "close that client");
  g_signal_connect(device, "control-lost", G_CALLBACK(+[](ArvDevice*, std::atomic<bool>* lost) { lost->store(true); }),
                   &session->controlLost);

  if (auto set = Setter(camera, session->info).apply(options); !set) return tl::unexpected(set.error());
  auto shape = readPicture(camera, session->info);
  if (!shape) return tl::unexpected(shape.error());
  session->shape = *shape;
  arv_camera_set_acquisition_mode(camera, ARV_ACQUISITION_MODE_CONTINUOUS, nullptr);
  if (auto started = session->startStream(options); !started) return tl::unexpected(started.error());
  return session;
}

tl::expected<void, Error> AravisCamera::Session::startStream(const CameraOptions& options) {
  if (!arv_camera_is_gv_device(camera.get())) {
    if (arv_camera_is_uv_device(camera.get())) arv_camera_uv_set_usb_mode(camera.get(), ARV_UV_USB_MODE_ASYNC);
    return stream_(options, 0);
  }
  if (options.packetSocket == PacketSocket::kOn && !packetSocketAllowed())
    return failed(EX_NOPERM, "camera.packet_socket = \"on\" needs the capability CAP_NET_RAW",
                  "grant it to the service, or set it to \"auto\"");
  info.packetSocket = options.packetSocket != PacketSocket::kOff && packetSocketAllowed();
  arv_camera_gv_set_stream_options(camera.get(), info.packetSocket ? ARV_GV_STREAM_OPTION_NONE
                                                                   : ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  arv_camera_gv_set_packet_size_adjustment(camera.get(), ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);

  const auto sizes = packetSizes(camera.get(), options);
  if (!sizes) return tl::unexpected(sizes.error());
  Proof proof = Proof::kNothing;
  for (const int size : *sizes) {
    if (auto started = stream_(options, size); !started) return started;
    proof = firstFrame();
    if (proof != Proof::kBroken) break;
  }
  info.packetSizeVerified = proof == Proof::kWhole;
  if (proof == Proof::kBroken)
    info.warnings.push_back("no whole frame has arrived yet, with packets of " + joined([&] {
                              std::vector<std::string> tried;
                              for (const int size : *sizes) tried.push_back(std::to_string(size));
                              return tried;
                            }()) +
                            " bytes; the network loses packets");
  return {};
}

tl::expected<void, Error> AravisCamera::Session::stream_(const CameraOptions& options, int packetSize_bytes) {
  Failure failure;
  if (stream) {
    arv_camera_stop_acquisition(camera.get(), nullptr);
    stream.reset();
  }
  if (packetSize_bytes > 0) {
    arv_camera_gv_set_packet_size(camera.get(), packetSize_bytes, failure.into());
    const guint got = failure ? 0 : arv_camera_gv_get_packet_size(camera.get(), failure.into());
    if (failure)
      return failed(EX_CONFIG,
                    "the camera refuses packets of " + std::to_string(packetSize_bytes) + " bytes: " + failure.text());
    info.packetSize_bytes = static_cast<int>(got);
  }
#if ARAVIS_CHECK_VERSION(0, 9, 0)
  stream.reset(arv_camera_create_stream(camera.get(), nullptr, nullptr, nullptr, failure.into()));
#else
  stream.reset(arv_camera_create_stream(camera.get(), nullptr, nullptr, failure.into()));
#endif
  if (!stream) return failed(EX_UNAVAILABLE, "the camera's stream cannot be opened", failure.text());
  if (ARV_IS_GV_STREAM(stream.get())) {
    g_object_set(stream.get(), "packet-timeout", static_cast<guint>(options.packetTimeout_us), "frame-retention",
                 static_cast<guint>(options.frameRetention_us), nullptr);
    info.receiveBuffer_bytes = setReceiveBuffer(stream.get(), options.receiveBuffer_bytes);
  }
  const guint payload = arv_camera_get_payload(camera.get(), failure.into());
  if (failure || payload < shape.size)
    return failed(EX_UNAVAILABLE,
                  "the camera announces " + std::to_string(payload) + " bytes for a picture of " +
                      std::to_string(shape.size),
                  failure ? failure.text() : "");
  for (int i = 0; i < options.buffers; ++i) {
    // The number goes along as the buffer's user data.
    ArvBuffer* buffer = arv_buffer_new_full(payload, nullptr, reinterpret_cast<void*>(number), nullptr);
    std::size_t unused = 0;
    // Touched now, no page is faulted in later.
    std::memset(const_cast<void*>(arv_buffer_get_data(buffer, &unused)), 0, payload);
    arv_stream_push_buffer(stream.get(), buffer);
  }
  arv_camera_start_acquisition(camera.get(), failure.into());
  if (failure) return failed(EX_UNAVAILABLE, "the camera does not start", failure.text());
  return {};
}

AravisCamera::Session::Proof AravisCamera::Session::firstFrame() const {
  // Four frames, should they be slow.
  const double patience_s = std::clamp(info.frameRate_Hz > 0 ? 4.0 / info.frameRate_Hz : 1.0, 1.0, 5.0);
  const std::int64_t until_ns = monotonicNow() + std::llround(patience_s * 1e9);
  constexpr int kChances = 3;
  int broken = 0;
  while (broken < kChances) {
    const std::int64_t left_ns = until_ns - monotonicNow();
    if (left_ns <= 0) break;
    ArvBuffer* buffer = arv_stream_timeout_pop_buffer(stream.get(), static_cast<guint64>(left_ns / 1000));
    if (buffer == nullptr) break;
    const bool whole = arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS;
    arv_stream_push_buffer(stream.get(), buffer);
    if (whole) return Proof::kWhole;
    ++broken;
  }
  return broken > 0 ? Proof::kBroken : Proof::kNothing;
}

// ---------------------------------------------------------------- keeper

struct AravisCamera::Keeper {
  std::mutex mutex;
  std::condition_variable_any changed;
  std::unique_ptr<Session> ready;
  std::jthread thread;  // last: joined before the others go

  Keeper(std::unique_ptr<Session> lost, CameraOptions options, Say say)
      : thread([this, lost = std::move(lost), options = std::move(options),
                say = std::move(say)](const std::stop_token& stop) mutable {
        pthread_setname_np(pthread_self(), "camera-keeper");
        reopen(stop, std::move(lost), std::move(options), say);
      }) {}

  void reopen(const std::stop_token& stop, std::unique_ptr<Session> lost, CameraOptions options, const Say& say);
};

namespace {

/// At most one try a second.
constexpr milliseconds kRetry{1000};

/// Sleeps unless asked to stop.
void pause(const std::stop_token& stop, std::int64_t until_ns) {
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock lock(mutex);
  const auto left = std::chrono::nanoseconds(until_ns - monotonicNow());
  if (left.count() > 0) never.wait_for(lock, stop, left, [] { return false; });
}

}  // namespace

void AravisCamera::Keeper::reopen(const std::stop_token& stop, std::unique_ptr<Session> lost, CameraOptions options,
                                  const Say& say) {
  const CameraName name = lost->info.name;
  const PictureShape shape = lost->shape;
  const bool byName = options.id.empty();
  // As it was, should it come back with its defaults.
  options.width = shape.width;
  options.height = shape.height;
  options.pixelFormat = knownFormat(shape.format)->name;
  lost.reset();
  std::string said;
  for (bool byAddress = true; !stop.stop_requested(); byAddress = !byAddress) {
    const std::int64_t next_ns = monotonicNow() + std::chrono::nanoseconds(kRetry).count();
    // The first camera found must be the same one now. Its address answers fastest, but may be new.
    if (byName) options.id = byAddress && !name.address.empty() ? name.address : name.vendor + "-" + name.serial;
    auto opened = Session::open(options);
    std::string problem;
    if (!opened)
      problem = opened.error().message();
    else if ((*opened)->info.name.vendor != name.vendor || (*opened)->info.name.serial != name.serial)
      problem = "camera: another one answers, " + (*opened)->info.name.id;
    else if ((*opened)->shape != shape)
      problem = "camera: " + name.id + " came back with another picture";
    if (problem.empty()) {
      const std::lock_guard lock(mutex);
      ready = std::move(*opened);
      changed.notify_all();
      return;
    }
    if (say && problem != said) say(problem);
    said = std::move(problem);
    pause(stop, next_ns);
  }
}

// ---------------------------------------------------------------- camera

std::vector<CameraName> listCameras(bool withFake) {
  if (withFake) arv_enable_interface("Fake");
  arv_update_device_list();
  std::vector<CameraName> all;
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) all.push_back(nameInList(i));
  return all;
}

tl::expected<std::unique_ptr<AravisCamera>, Error> AravisCamera::open(const CameraOptions& options, Ledger& ledger,
                                                                      std::stop_token stop, Say say) {
  // A client that died holds the camera until the camera misses its heartbeat, 3 s by default.
  constexpr std::int64_t kHeartbeat_ns = 5'000'000'000;
  std::int64_t heldSince_ns = 0;
  bool said = false;
  while (!stop.stop_requested()) {
    const std::int64_t now_ns = monotonicNow();
    auto session = Session::open(options);
    if (session) {
      return std::unique_ptr<AravisCamera>(new AravisCamera(options, ledger, std::move(say), std::move(*session)));
    }
    const Error& error = session.error();
    const bool held = error.exitCode == EX_TEMPFAIL;
    if (held && heldSince_ns == 0) heldSince_ns = now_ns;
    if (held && monotonicNow() - heldSince_ns > kHeartbeat_ns) return tl::unexpected(error);
    if (!held && (error.exitCode != EX_UNAVAILABLE || !options.wait)) return tl::unexpected(error);
    if (!held) heldSince_ns = 0;
    if (say && !said) say(error.message() + "; waiting");
    said = true;
    pause(stop, now_ns + std::chrono::nanoseconds(kRetry).count());
  }
  return failed(EX_OK, "stopped while waiting");
}

AravisCamera::AravisCamera(const CameraOptions& options, Ledger& ledger, Say say, std::unique_ptr<Session> session)
    : options_(options)
    , ledger_(ledger)
    , say_(std::move(say))
    , info_(session->info)
    , gate_(session->shape, FrameGate::Options{.zeroIsAnId = session->info.name.protocol != "GigEVision"})
    , session_(std::move(session))
    , lastArrival_ns_(monotonicNow()) {
  if (info_.receiveBuffer_bytes > 0 && !info_.packetSocket && info_.receiveBuffer_bytes < options.receiveBuffer_bytes)
    info_.warnings.push_back("the kernel grants a receive buffer of " + std::to_string(info_.receiveBuffer_bytes) +
                             " bytes instead of " + std::to_string(options.receiveBuffer_bytes) +
                             "; sysctl -w net.core.rmem_max=" + std::to_string(options.receiveBuffer_bytes));
}

AravisCamera::~AravisCamera() = default;

Next AravisCamera::next(Frame& frame, milliseconds timeout) {
  if (!session_ && !adopt(timeout)) return Next::kTimeout;
  void* buffer = arv_stream_timeout_pop_buffer(
      session_->stream.get(),
      static_cast<guint64>(std::chrono::duration_cast<std::chrono::microseconds>(timeout).count()));
  if (buffer != nullptr) return fill(frame, buffer);

  const std::int64_t silence_ns = monotonicNow() - lastArrival_ns_;
  session_->silent =
      options_.silenceTimeout_ms > 0 && silence_ns > std::int64_t{options_.silenceTimeout_ms} * 1'000'000;
  if (session_->silent || session_->controlLost) lose();
  return Next::kTimeout;
}

Next AravisCamera::fill(Frame& frame, void* handle) {
  Arrival arrival;
  arrival.host_ns = monotonicNow();
  const std::int64_t real_ns = realNow();
  lastArrival_ns_ = arrival.host_ns;
  auto* buffer = static_cast<ArvBuffer*>(handle);
  arrival.complete = arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS;
  arrival.id = arv_buffer_get_frame_id(buffer);
  arrival.device_ns = static_cast<std::int64_t>(arv_buffer_get_timestamp(buffer));
  const void* data = nullptr;
  // Aravis complains on the console when it is asked for the picture of something that is none.
  const ArvBufferPayloadType payload = arv_buffer_get_payload_type(buffer);
  if (arrival.complete &&
      (payload == ARV_BUFFER_PAYLOAD_TYPE_IMAGE || payload == ARV_BUFFER_PAYLOAD_TYPE_EXTENDED_CHUNK_DATA)) {
    data = arv_buffer_get_image_data(buffer, &arrival.shape.size);
    arrival.shape.width = arv_buffer_get_image_width(buffer);
    arrival.shape.height = arv_buffer_get_image_height(buffer);
    arrival.shape.format = arv_buffer_get_image_pixel_format(buffer);
  }
  const Judgement judgement = gate_.judge(arrival);
  count(judgement, ledger_);
  if (judgement.verdict != Verdict::kNew) {
    arv_stream_push_buffer(session_->stream.get(), buffer);
    return Next::kRejected;
  }
  if (judgement.newTimeline) clock_.restart();
  const DeviceClock::Moment captured = clock_.add(arrival.device_ns, arrival.host_ns);

  frame = Frame{};
  frame.info.cameraFrameId = arrival.id;
  frame.info.frameNumber = judgement.frameNumber;
  frame.info.exposure_s = info_.exposure_s;
  frame.info.discontinuity = judgement.discontinuity;
  frame.info.times.device_ns = arrival.device_ns;
  frame.info.times.received_ns = arrival.host_ns;
  frame.info.times.receivedReal_ns = real_ns;
  frame.info.times.captured_ns = captured.captured_ns;
  frame.info.times.capturedError_ns = captured.error_ns;
  frame.data = static_cast<const std::uint8_t*>(data);
  frame.size = arrival.shape.size;
  frame.width = arrival.shape.width;
  frame.height = arrival.shape.height;
  frame.stride = static_cast<int>(arrival.shape.size) / arrival.shape.height;
  frame.format = info_.format;
  frame.token = buffer;
  return Next::kFrame;
}

void AravisCamera::recycle(Frame& frame) {
  if (frame.token == nullptr) return;
  auto* buffer = static_cast<ArvBuffer*>(std::exchange(frame.token, nullptr));
  frame.data = nullptr;
  const auto number = reinterpret_cast<std::uintptr_t>(arv_buffer_get_user_data(buffer));
  if (session_ && session_->number == number)
    arv_stream_push_buffer(session_->stream.get(), buffer);
  else
    g_object_unref(buffer);
}

void AravisCamera::lose() {
  if (say_)
    say_("camera " + info_.name.id + (session_->controlLost ? " took control away" : " fell silent") +
         "; it is opened again");
  keeper_ = std::make_unique<Keeper>(std::move(session_), options_, say_);
}

bool AravisCamera::adopt(milliseconds timeout) {
  {
    std::unique_lock lock(keeper_->mutex);
    if (!keeper_->changed.wait_for(lock, timeout, [&] { return keeper_->ready != nullptr; })) return false;
    session_ = std::move(keeper_->ready);
  }
  keeper_.reset();
  ledger_.reconnects.add();
  gate_.restart();
  lastArrival_ns_ = monotonicNow();
  return true;
}

}  // namespace tractiond::capture

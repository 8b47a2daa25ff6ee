// Strategy. Aravis lists and opens; everything it is vague about is asked again: whether we control the camera, what a
// setting became, how large a packet the interface carries, how large a receive buffer the kernel gave. A setting is
// checked against the camera's own description first, so that a refusal can say what would be allowed.
#include "daemon/capture/camera_setup.h"

#include "daemon/base/clock.h"

#include <arpa/inet.h>
#include <arv.h>
#include <dirent.h>
#include <ifaddrs.h>
#include <linux/if_ether.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <mutex>
#include <utility>

namespace tractiond::capture {
namespace {

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

std::string hexadecimal(std::uint32_t value) {
  std::array<char, 16> digits{};
  std::snprintf(digits.data(), digits.size(), "0x%08x", value);
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

std::vector<std::string> offeredFormats(ArvCamera* camera) {
  guint count = 0;
  const char** names = arv_camera_dup_available_pixel_formats_as_strings(camera, &count, nullptr);
  return taken(names, count);
}

// ---------------------------------------------------------------- finding

CameraName nameInList(unsigned index) {
  return {text(arv_get_device_id(index)),      text(arv_get_device_physical_id(index)),
          text(arv_get_device_address(index)), text(arv_get_device_vendor(index)),
          text(arv_get_device_model(index)),   text(arv_get_device_serial_nbr(index)),
          text(arv_get_device_protocol(index))};
}

/// Where it is shown, Aravis's in-process camera comes first.
void showFake(bool shown) {
  if (shown)
    arv_enable_interface("Fake");
  else
    arv_disable_interface("Fake");
}

bool isAddress(const std::string& id) {
  in_addr address{};
  return inet_pton(AF_INET, id.c_str(), &address) == 1;
}

bool matches(const CameraName& name, const std::string& id) {
  const auto same = [&](const std::string& other) { return g_ascii_strcasecmp(other.c_str(), id.c_str()) == 0; };
  return same(name.id) || same(name.physicalId) || same(name.address) || same(name.vendor + "-" + name.serial);
}

/// Looks in the list itself: Aravis would ask the name server for an unknown id.
tl::expected<Ref<ArvCamera>, Error> find(const CameraOptions& options) {
  showFake(options.fakeInterface);
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
    return failed(EX_UNAVAILABLE, id.empty() ? "no camera answers" : "camera \"" + options.id + "\" does not answer",
                  id.empty() ? "" : failure.text());
  return camera;
}

/// Aravis opens a camera that another client controls as if nothing were amiss. Who holds it is not read while waiting:
/// some cameras take that register's reading, by anybody, for their holder's heartbeat (Aravis's fake does).
bool takeControl(ArvGvDevice* device, std::int64_t until_ns, const std::stop_token& stop) {
  while (!arv_gv_device_is_controller(device) && !arv_gv_device_take_control(device, nullptr)) {
    if (stop.stop_requested() || monotonicNow() > until_ns) return false;
    pauseUntil(monotonicNow() + 200'000'000, stop);
  }
  return true;
}

}  // namespace

void Unref::operator()(void* object) const {
  g_object_unref(object);
}

tl::unexpected<Error> failed(int exitCode, std::string what, std::string remedy) {
  return tl::unexpected(Error{exitCode, std::move(what), "", std::move(remedy)});
}

tl::unexpected<Error> failed(int exitCode, std::string what, GError* reason) {
  auto error = failed(exitCode, std::move(what), reason == nullptr ? "" : reason->message);
  g_clear_error(&reason);
  return error;
}

void pauseUntil(std::int64_t until_ns, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock lock(mutex);
  const auto left = std::chrono::nanoseconds(until_ns - monotonicNow());
  if (left.count() > 0) never.wait_for(lock, stop, left, [] { return false; });
}

std::vector<CameraName> listCameras(bool withFake) {
  showFake(withFake);
  arv_update_device_list();
  std::vector<CameraName> all;
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) all.push_back(nameInList(i));
  return all;
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

tl::expected<Ref<ArvCamera>, Error> connectCamera(const CameraOptions& options, const std::stop_token& stop,
                                                  const Say& say) {
  // A camera forgets a client that died 3 s after its last heartbeat, and one try may take Aravis 2.5 s.
  constexpr std::int64_t kPatience_ns = 8'000'000'000;
  const std::int64_t until_ns = monotonicNow() + kPatience_ns;
  auto camera = find(options);
  if (!camera) return camera;
  ArvDevice* device = arv_camera_get_device(camera->get());
  if (!ARV_IS_GV_DEVICE(device) || arv_gv_device_is_controller(ARV_GV_DEVICE(device))) return camera;
  const CameraName name = nameOf(camera->get());
  const std::string held = "camera " + name.id + " at " + name.address + " is held by another client";
  if (say) say(held);
  if (!takeControl(ARV_GV_DEVICE(device), until_ns, stop)) return failed(EX_TEMPFAIL, held, "close that client");
  return camera;
}

// ---------------------------------------------------------------- setting

namespace {

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
  Result setCommand(const Feature& feature);
  Result setBoolean(const Feature& feature);
  Result setEnumeration(const Feature& feature);
  Result setInteger(const Feature& feature);
  Result setFloat(const Feature& feature);
  Result setText(const Feature& feature);
  Result setPixelFormat(const std::string& name);
  template <class Write, class Read>
  Result setByHelper(const char* name, double value, Write write, Read read);

  static Result refuse(const Feature& feature, const std::string& why, const std::string& remedy = {}) {
    return failed(EX_CONFIG, "the camera refuses " + feature.name + " = " + written(feature) + ": " + why, remedy);
  }
  Result finish(const std::string& name, double asked, double got, const Failure& failure);
  Result finish(const Feature& feature, const std::string& got, const Failure& failure);

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

Setter::Result Setter::finish(const Feature& feature, const std::string& got, const Failure& failure) {
  if (failure) return refuse(feature, failure.text());
  if (got != written(feature)) return refuse(feature, "it still says " + got);
  info_.settings.push_back(feature.name + " = " + got);
  return {};
}

template <class Write, class Read>
Setter::Result Setter::setByHelper(const char* name, double value, Write write, Read read) {
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
  constexpr const char* kOrder = "the order of the features may matter";
  if (!arv_gc_feature_node_is_available(ARV_GC_FEATURE_NODE(node), nullptr))
    return refuse(feature, "it is not available", kOrder);
  if (arv_gc_feature_node_is_locked(ARV_GC_FEATURE_NODE(node), nullptr)) return refuse(feature, "it is locked", kOrder);
  if (arv_device_get_feature_access_mode(device_, name) == ARV_GC_ACCESS_MODE_RO)
    return refuse(feature, "it can only be read");
  // The order matters: an enumeration is an integer and a text as well.
  if (ARV_IS_GC_COMMAND(node)) return setCommand(feature);
  if (ARV_IS_GC_BOOLEAN(node)) return setBoolean(feature);
  if (ARV_IS_GC_ENUMERATION(node)) return setEnumeration(feature);
  if (ARV_IS_GC_INTEGER(node)) return setInteger(feature);
  if (ARV_IS_GC_FLOAT(node)) return setFloat(feature);
  if (ARV_IS_GC_STRING(node)) return setText(feature);
  return refuse(feature, "a feature of this kind cannot be written");
}

Setter::Result Setter::setCommand(const Feature& feature) {
  const bool* execute = std::get_if<bool>(&feature.value);
  if (execute == nullptr || !*execute) return refuse(feature, "it is a command", "write " + feature.name + " = true");
  Failure failure;
  arv_device_execute_command(device_, feature.name.c_str(), failure.into());
  if (failure) return refuse(feature, failure.text());
  info_.settings.push_back(feature.name + " executed");
  return {};
}

Setter::Result Setter::setBoolean(const Feature& feature) {
  const bool* value = std::get_if<bool>(&feature.value);
  if (value == nullptr) return refuse(feature, "it is true or false");
  Failure failure;
  arv_device_set_boolean_feature_value(device_, feature.name.c_str(), *value, failure.into());
  if (failure) return refuse(feature, failure.text());
  const bool got = arv_device_get_boolean_feature_value(device_, feature.name.c_str(), failure.into()) != FALSE;
  return finish(feature, got ? "true" : "false", failure);
}

Setter::Result Setter::setEnumeration(const Feature& feature) {
  guint count = 0;
  const char** entries =
      arv_device_dup_available_enumeration_feature_values_as_strings(device_, feature.name.c_str(), &count, nullptr);
  const std::vector<std::string> offered = taken(entries, count);
  const std::string* value = std::get_if<std::string>(&feature.value);
  if (value == nullptr || std::find(offered.begin(), offered.end(), *value) == offered.end())
    return refuse(feature, "it is one of " + joined(offered));
  return setText(feature);
}

Setter::Result Setter::setInteger(const Feature& feature) {
  const std::int64_t* value = std::get_if<std::int64_t>(&feature.value);
  if (value == nullptr) return refuse(feature, "it is a whole number");
  const char* name = feature.name.c_str();
  Failure failure;
  gint64 low = 0, high = 0;
  arv_device_get_integer_feature_bounds(device_, name, &low, &high, failure.into());
  if (!failure && (*value < low || *value > high))
    return refuse(feature, "it may be " + std::to_string(low) + " to " + std::to_string(high));
  arv_device_set_integer_feature_value(device_, name, *value, failure.into());
  if (failure) return refuse(feature, failure.text());
  const gint64 got = arv_device_get_integer_feature_value(device_, name, failure.into());
  return finish(feature.name, static_cast<double>(*value), static_cast<double>(got), failure);
}

Setter::Result Setter::setFloat(const Feature& feature) {
  const double* real = std::get_if<double>(&feature.value);
  const std::int64_t* whole = std::get_if<std::int64_t>(&feature.value);
  if (real == nullptr && whole == nullptr) return refuse(feature, "it is a number");
  const double value = real != nullptr ? *real : static_cast<double>(*whole);
  const char* name = feature.name.c_str();
  Failure failure;
  double low = 0, high = 0;
  arv_device_get_float_feature_bounds(device_, name, &low, &high, failure.into());
  if (!failure && (value < low || value > high))
    return refuse(feature, "it may be " + number(low) + " to " + number(high));
  arv_device_set_float_feature_value(device_, name, value, failure.into());
  if (failure) return refuse(feature, failure.text());
  const double got = arv_device_get_float_feature_value(device_, name, failure.into());
  return finish(feature.name, value, got, failure);
}

Setter::Result Setter::setText(const Feature& feature) {
  const std::string* value = std::get_if<std::string>(&feature.value);
  if (value == nullptr) return refuse(feature, "it is a text");
  Failure failure;
  arv_device_set_string_feature_value(device_, feature.name.c_str(), value->c_str(), failure.into());
  if (failure) return refuse(feature, failure.text());
  const std::string got = text(arv_device_get_string_feature_value(device_, feature.name.c_str(), failure.into()));
  return finish(feature, got, failure);
}

/// By its code: cameras spell the names differently (RGB8Packed).
Setter::Result Setter::setPixelFormat(const std::string& name) {
  const Feature feature{"PixelFormat", name};
  const PixelFormatTraits* known = pixelFormatByName(name);
  if (known == nullptr) return refuse(feature, "what can be read: " + std::string(kPixelFormatsInWords));
  Failure failure;
  if (arv_camera_get_pixel_format(camera_, failure.into()) != known->code()) {
    guint count = 0;
    gint64* codes = arv_camera_dup_available_pixel_formats(camera_, &count, failure.into());
    const bool offered = codes != nullptr && std::find(codes, codes + count, gint64{known->code()}) != codes + count;
    g_free(codes);
    if (!offered) return refuse(feature, "it offers " + joined(offeredFormats(camera_)));
    arv_camera_set_pixel_format(camera_, known->code(), failure.into());
    if (failure) return refuse(feature, failure.text());
    if (arv_camera_get_pixel_format(camera_, failure.into()) != known->code())
      return refuse(feature, "it did not take it");
  }
  info_.settings.push_back("PixelFormat = " + name);
  return {};
}

Setter::Result Setter::apply(const CameraOptions& options) {
  Result result;
  if (!options.pixelFormat.empty()) result = setPixelFormat(options.pixelFormat);
  if (result && options.width > 0) result = set({"Width", std::int64_t{options.width}});
  if (result && options.height > 0) result = set({"Height", std::int64_t{options.height}});
  // Sets what belongs to it as well, and clears triggers: before the features.
  if (result && options.frameRate_Hz > 0)
    result = setByHelper("the frame rate", options.frameRate_Hz, arv_camera_set_frame_rate, arv_camera_get_frame_rate);
  if (result && options.exposure_us > 0)
    result = setByHelper("the exposure time", options.exposure_us, arv_camera_set_exposure_time,
                         arv_camera_get_exposure_time);
  if (result && options.gain) result = setByHelper("the gain", *options.gain, arv_camera_set_gain, arv_camera_get_gain);
  for (std::size_t i = 0; result && i < options.features.size(); ++i) result = set(options.features[i]);
  return result;
}

}  // namespace

tl::expected<void, Error> applySettings(ArvCamera* camera, const CameraOptions& options, CameraInfo& info) {
  return Setter(camera, info).apply(options);
}

tl::expected<PictureShape, Error> readPicture(ArvCamera* camera, CameraInfo& info) {
  Failure failure;
  const ArvPixelFormat code = arv_camera_get_pixel_format(camera, failure.into());
  if (failure) return failed(EX_UNAVAILABLE, "the camera does not tell its pixel format", failure.text());
  const PixelFormatTraits* known = pixelFormatByCode(code);
  if (known == nullptr) {
    const std::vector<std::string> offered = offeredFormats(camera);
    std::string own = text(arv_camera_get_pixel_format_as_string(camera, failure.into()));
    if (own.empty()) own = "pictures of the format " + hexadecimal(code);
    return failed(EX_CONFIG, "the camera sends " + own + ", which cannot be read; it offers " + joined(offered),
                  "set camera.pixel_format to one that can: " + std::string(kPixelFormatsInWords));
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
  shape.size = known->size(width, height);
  shape.format = code;
  return shape;
}

// ---------------------------------------------------------------- network

namespace {

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
    const int descriptor = static_cast<int>(std::strtol(entry->d_name, nullptr, 10));
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

}  // namespace

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

std::string usbMemoryWarning(std::size_t needed_bytes) {
  std::ifstream file("/sys/module/usbcore/parameters/usbfs_memory_mb");
  std::size_t limit_MiB = 0;  // 0: without limit
  if (!(file >> limit_MiB) || limit_MiB == 0 || needed_bytes <= limit_MiB << 20) return {};
  return "the buffers need " + std::to_string(needed_bytes >> 20) + " MiB, but USB devices may use " +
         std::to_string(limit_MiB) + "; echo 1000 > /sys/module/usbcore/parameters/usbfs_memory_mb";
}

}  // namespace tractiond::capture

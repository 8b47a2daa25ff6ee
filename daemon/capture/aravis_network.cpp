// What the network between camera and host carries: packet sizes, receive buffers; and USB's memory.
#include "base/clock.h"
#include "daemon/capture/aravis.h"

#include <arpa/inet.h>
#include <dirent.h>
#include <ifaddrs.h>
#include <linux/sock_diag.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>

namespace tractiond::capture {
namespace {

std::uint32_t ipv4Of(GSocketAddress* address) {
  std::uint32_t bytes = 0;
  std::memcpy(&bytes, g_inet_address_to_bytes(g_inet_socket_address_get_address(G_INET_SOCKET_ADDRESS(address))),
              sizeof bytes);
  return ntohl(bytes);
}

/// 0: not known.
int mtuOf(ArvGvDevice* device) {
  char* address = g_inet_address_to_string(
      g_inet_socket_address_get_address(G_INET_SOCKET_ADDRESS(arv_gv_device_get_device_address(device))));
  const std::vector<std::string> towards = interfacesTowards(address);
  const std::string interface = towards.empty() ? std::string() : towards.back();
  g_free(address);
  ifreq request{};
  interface.copy(request.ifr_name, IFNAMSIZ - 1);
  const int probe = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const bool known = probe >= 0 && ioctl(probe, SIOCGIFMTU, &request) == 0;
  if (probe >= 0) close(probe);
  return known ? request.ifr_mtu : 0;
}

struct UdpSocket {
  int descriptor = -1;
  std::uint64_t inode = 0;
  std::uint32_t address = 0;  ///< IPv4, 127.0.0.1 as 0x7f000001
  std::uint16_t port = 0;
};

/// This process's own. Aravis hides those that it opens.
std::vector<UdpSocket> udpSockets() {
  std::vector<UdpSocket> all;
  DIR* folder = opendir("/proc/self/fd");
  for (const dirent* entry = nullptr; folder != nullptr && (entry = readdir(folder)) != nullptr;) {
    const int descriptor = static_cast<int>(std::strtol(entry->d_name, nullptr, 10));
    sockaddr_in address{};
    socklen_t length = sizeof address;
    int type = 0;
    socklen_t typeLength = sizeof type;
    struct stat known {};
    if (entry->d_name[0] != '.' && getsockopt(descriptor, SOL_SOCKET, SO_TYPE, &type, &typeLength) == 0 &&
        type == SOCK_DGRAM && getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &length) == 0 &&
        address.sin_family == AF_INET && fstat(descriptor, &known) == 0)
      all.push_back({descriptor, known.st_ino, ntohl(address.sin_addr.s_addr), ntohs(address.sin_port)});
  }
  if (folder != nullptr) closedir(folder);
  return all;
}

/// -1: not found.
int streamSocket(ArvStream* stream) {
  const std::uint16_t port = arv_gv_stream_get_port(ARV_GV_STREAM(stream));
  for (const UdpSocket& one : udpSockets())
    if (one.port == port) return one.descriptor;
  return -1;
}

/// Puts it on, and throws away what came before it did. EX_OSERR: the socket takes none.
/// \param descriptor -1: it was not found
tl::expected<void, Error> attach(int descriptor, std::vector<sock_filter> code) {
  const sock_fprog program{static_cast<unsigned short>(code.size()), code.data()};
  if (setsockopt(descriptor, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program) != 0)
    return failed(EX_OSERR, "a socket cannot be guarded against packets that are not the camera's",
                  descriptor < 0 ? "it is not found in /proc/self/fd" : std::strerror(errno));
  for (char byte = 0; recv(descriptor, &byte, 1, MSG_DONTWAIT) >= 0;) {
  }
  return {};
}

bool usesExtendedIds(ArvDevice* device) {
  return readFeature(device, "GevGVSPExtendedIDMode") == "On";
}

/// Packets that the kernel has dropped at a socket; 0: not known.
std::uint32_t dropsOf(int descriptor) {
  std::uint32_t memory[SK_MEMINFO_VARS] = {};
  socklen_t length = sizeof memory;
  return getsockopt(descriptor, SOL_SOCKET, SO_MEMINFO, memory, &length) == 0 ? memory[SK_MEMINFO_DROPS] : 0;
}

}  // namespace

std::vector<std::string> interfacesTowards(const std::string& address) {
  in_addr camera{};
  ifaddrs* all = nullptr;
  std::vector<std::string> found;
  if (inet_pton(AF_INET, address.c_str(), &camera) != 1 || getifaddrs(&all) != 0) return found;
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_netmask == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
    if ((one->ifa_flags & IFF_UP) == 0) continue;  // it has no route
    const auto own = reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr.s_addr;
    const auto mask = reinterpret_cast<const sockaddr_in*>(one->ifa_netmask)->sin_addr.s_addr;
    const std::string name = one->ifa_name, card = name.substr(0, name.find(':'));  // without the label of an alias
    if ((own & mask) == (camera.s_addr & mask) && std::ranges::find(found, card) == found.end()) found.push_back(card);
  }
  freeifaddrs(all);
  return found;
}

std::string ambiguity(const std::string& address) {
  const std::vector<std::string> towards = interfacesTowards(address);
  if (towards.size() < 2) return {};
  return "the interfaces " + joined(towards) + " are all in the network of " + address +
         ", and this host sends to it through one of them, which need not be the one that the camera is connected to: "
         "give each interface, and the cameras behind it, a network of its own, or disconnect the others";
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

StreamShape streamShape(ArvCamera* camera, int packetSize_bytes, std::size_t payload_bytes, std::size_t picture_bytes) {
  ArvDevice* device = arv_camera_get_device(camera);
  StreamShape shape{
      .packetSize_bytes = packetSize_bytes, .payload_bytes = payload_bytes, .picture_bytes = picture_bytes};
  shape.cameraAddress = ipv4Of(arv_gv_device_get_device_address(ARV_GV_DEVICE(device)));
  Failure failure;
  const gint64 port = arv_device_get_integer_feature_value(device, "ArvGevSCSP", failure.into());
  if (!failure && port > 0 && port < 65536) shape.cameraPort = static_cast<std::uint16_t>(port);
  shape.extendedIds = usesExtendedIds(device);
  return shape;
}

tl::expected<void, Error> guardStream(ArvStream* stream, const StreamShape& shape) {
  aravis::stopReceiving(stream);
  const auto attached = attach(streamSocket(stream), streamFilter(shape));
  aravis::startReceiving(stream);
  return attached;
}

tl::expected<PacketSurvey, Error> surveyStream(ArvStream* stream, const StreamShape& shape,
                                               std::chrono::milliseconds patience) {
  const int descriptor = streamSocket(stream);
  PacketSurvey survey;
  aravis::stopReceiving(stream);
  const std::int64_t until_ns = monotonicNow() + std::chrono::nanoseconds(patience).count();
  auto attached = attach(descriptor, senderFilter(shape.cameraAddress));
  if (attached) {
    std::vector<std::uint8_t> packet(65536);
    while (!survey.isOver()) {
      const std::int64_t left_ms = (until_ns - monotonicNow()) / 1'000'000;
      pollfd item{descriptor, POLLIN, 0};
      if (left_ms <= 0 || poll(&item, 1, static_cast<int>(left_ms)) == 0) break;
      sockaddr_in from{};
      socklen_t length = sizeof from;
      const ssize_t got =
          recvfrom(descriptor, packet.data(), packet.size(), MSG_DONTWAIT, reinterpret_cast<sockaddr*>(&from), &length);
      if (got > 0) survey.see({packet.data(), static_cast<std::size_t>(got)}, ntohs(from.sin_port));
    }
    attached = attach(descriptor, streamFilter(shape));
  }
  aravis::startReceiving(stream);
  if (!attached) return tl::unexpected(attached.error());
  return survey;
}

std::uint64_t packetsRefused(ArvStream* stream) {
  return dropsOf(streamSocket(stream));
}

ControlGuard::ControlGuard() {
  for (const UdpSocket& one : udpSockets()) before_.push_back(one.inode);
}

tl::expected<void, Error> ControlGuard::guard(ArvGvDevice* device) {
  const std::uint32_t here = ipv4Of(arv_gv_device_get_interface_address(device));
  GSocketAddress* camera = arv_gv_device_get_device_address(device);
  const std::uint32_t address = ipv4Of(camera);
  const std::uint16_t port = g_inet_socket_address_get_port(G_INET_SOCKET_ADDRESS(camera));
  for (const UdpSocket& one : udpSockets()) {
    const bool isNew = std::find(before_.begin(), before_.end(), one.inode) == before_.end();
    const bool isCamera = one.address == address && one.port == port;  // one that this process itself serves
    if (one.address == here && isNew && !isCamera) descriptor_ = one.descriptor;
  }
  return attach(descriptor_, senderFilter(address, port));
}

std::uint64_t ControlGuard::refused() const {
  return descriptor_ < 0 ? 0 : dropsOf(descriptor_);
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
  if (failure) low = high = 0;
  if (high > 0) largest = static_cast<int>(std::min<gint64>(largest, high));
  gint64 increment = arv_device_get_integer_feature_increment(device, "GevSCPSPacketSize", failure.into());
  if (failure || increment < 1) increment = 4;  // GigE Vision demands as much
  if (arv_device_get_feature(device, "GevSCPSFireTestPacket") != nullptr) {
    const guint tested = arv_camera_gv_auto_packet_size(camera, failure.into());
    if (!failure && tested >= kAnyNetwork) largest = std::min(largest, static_cast<int>(tested));
  }
  StreamShape shape;
  shape.extendedIds = usesExtendedIds(device);
  const int headers_bytes = StreamShape::kNetworkHeaders_bytes + shape.headerBytes();
  const auto even = [&](int size) {
    const int least = static_cast<int>(std::clamp<gint64>(low, 0, size));
    return evenPacketSize(size, headers_bytes, least, static_cast<int>(std::min<gint64>(increment, size)));
  };
  std::vector<int> sizes{even(largest)};
  for (const int safe : {kEthernet, kAnyNetwork})
    if (safe < largest && even(safe) < sizes.back()) sizes.push_back(even(safe));
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

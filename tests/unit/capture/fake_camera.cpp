#include "tests/unit/capture/fake_camera.h"

#include "base/aravis_versions.h"

#include <arpa/inet.h>
#include <arv.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <stdexcept>

namespace tractiond::test {

struct FakeCamera::Painter {
  std::uint64_t count = 0;

  static void paint(ArvBuffer* buffer, void* self, std::uint32_t, std::uint32_t, ArvPixelFormat) {
    std::size_t unused = 0;
    // The size is not told here; 8 bytes fit into every picture.
    auto* data = const_cast<void*>(arv_buffer_get_data(buffer, &unused));
    const std::uint64_t count = ++static_cast<Painter*>(self)->count;
    std::memcpy(data, &count, sizeof count);
  }
};

FakeCamera::FakeCamera(const Options& options)
    : painter_(std::make_unique<Painter>())
    , camera_(arv_gv_fake_camera_new(options.address.c_str(), options.serial.c_str())) {
  if (!arv_gv_fake_camera_is_running(camera_)) throw std::runtime_error("the fake camera does not run");
  write(ARV_FAKE_CAMERA_REGISTER_WIDTH, static_cast<std::uint32_t>(options.width));
  write(ARV_FAKE_CAMERA_REGISTER_HEIGHT, static_cast<std::uint32_t>(options.height));
  write(ARV_FAKE_CAMERA_REGISTER_PIXEL_FORMAT, options.format);
  write(ARV_FAKE_CAMERA_REGISTER_ACQUISITION_FRAME_PERIOD_US, static_cast<std::uint32_t>(1e6 / options.rate_Hz));
  aravis::setFillPattern(arv_gv_fake_camera_get_fake_camera(camera_), &Painter::paint, painter_.get());
}

FakeCamera::~FakeCamera() {
  g_object_unref(camera_);
}

void FakeCamera::write(std::uint32_t address, std::uint32_t value) {
  arv_fake_camera_write_register(arv_gv_fake_camera_get_fake_camera(camera_), address, value);
}

std::uint32_t FakeCamera::read(std::uint32_t address) const {
  std::uint32_t value = 0;
  arv_fake_camera_read_register(arv_gv_fake_camera_get_fake_camera(camera_), address, &value);
  return value;
}

void FakeCamera::losePackets(double share) {
  g_object_set(camera_, "gvsp-lost-ratio", share, nullptr);
}

CameraProcess::CameraProcess() {
  int ready[2] = {-1, -1};
  if (pipe(ready) != 0) throw std::runtime_error("pipe");
  child_ = fork();
  if (child_ == 0) {
    dup2(ready[1], STDOUT_FILENO);
    execl("/proc/self/exe", "fake-camera", "--fake-camera", nullptr);
    _exit(127);
  }
  close(ready[1]);
  char byte = 0;
  const bool started = ::read(ready[0], &byte, 1) == 1;
  close(ready[0]);
  if (!started) throw std::runtime_error("the camera process did not start");
}

CameraProcess::~CameraProcess() {
  kill();
}

void CameraProcess::kill() {
  if (child_ <= 0) return;
  ::kill(child_, SIGKILL);
  waitpid(child_, nullptr, 0);
  child_ = 0;
}

int CameraProcess::main() {
  const FakeCamera camera(FakeCamera::Options{.width = 512, .height = 512, .format = ARV_PIXEL_FORMAT_MONO_8});
  if (::write(STDOUT_FILENO, "+", 1) != 1) return EXIT_FAILURE;
  for (;;) pause();
}

namespace {

/// A socket that talks to this address only.
int connectedTo(std::uint32_t address, std::uint32_t port) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(port));
  to.sin_addr.s_addr = htonl(address);
  const int descriptor = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  EXPECT_EQ(connect(descriptor, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
  return descriptor;
}

void sendAll(int descriptor, const std::vector<std::uint8_t>& data) {
  EXPECT_EQ(::send(descriptor, data.data(), data.size(), 0), static_cast<ssize_t>(data.size()));
}

/// Big-endian, as GigE Vision is.
class Packet {
 public:
  Packet& u8(std::uint64_t value) { return append(value, 1); }
  Packet& u16(std::uint64_t value) { return append(value, 2); }
  Packet& u24(std::uint64_t value) { return append(value, 3); }
  Packet& u32(std::uint64_t value) { return append(value, 4); }
  Packet& u64(std::uint64_t value) { return append(value, 8); }
  std::vector<std::uint8_t> bytes;

 private:
  Packet& append(std::uint64_t value, int size) {
    for (int i = size - 1; i >= 0; --i) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
    return *this;
  }
};

}  // namespace

std::uint32_t readRegister(std::uint32_t address) {
  constexpr std::uint32_t kControlPort = 3956;
  const int descriptor = connectedTo(INADDR_LOOPBACK, kControlPort);
  sendAll(descriptor, Packet().u8(0x42).u8(1).u16(0x0080).u16(4).u16(1).u32(address).bytes);
  std::uint8_t answer[12] = {};
  pollfd wait{descriptor, POLLIN, 0};
  EXPECT_EQ(poll(&wait, 1, 2000), 1);
  EXPECT_EQ(recv(descriptor, answer, sizeof answer, 0), 12);
  close(descriptor);
  return std::uint32_t{answer[8]} << 24 | std::uint32_t{answer[9]} << 16 | std::uint32_t{answer[10]} << 8 | answer[11];
}

Intruder::Intruder(const FakeCamera& camera) {
  constexpr std::uint32_t kStreamPort = 0x0d00, kStreamAddress = 0x0d18;
  socket_ = connectedTo(camera.read(kStreamAddress), camera.read(kStreamPort));
}

Intruder::~Intruder() {
  close(socket_);
}

void Intruder::send(const std::vector<std::uint8_t>& datagram) const {
  sendAll(socket_, datagram);
}

void Intruder::sendPicture(std::uint16_t id, std::uint64_t device_ns, int width, int height, std::uint32_t format,
                           const std::vector<std::uint8_t>& data, int packetSize_bytes) const {
  enum : std::uint8_t { kLeader = 1, kTrailer = 2, kPayload = 3 };
  const auto header = [&](std::uint8_t kind, std::uint32_t packet) {
    return Packet().u16(0).u16(id).u8(kind).u24(packet);
  };
  send(header(kLeader, 0)
           .u16(0)
           .u16(1)
           .u64(device_ns)
           .u32(format)
           .u32(static_cast<std::uint32_t>(width))
           .u32(static_cast<std::uint32_t>(height))
           .u32(0)
           .u32(0)
           .u16(0)
           .u16(0)
           .bytes);
  constexpr int kHeaders_bytes = 20 + 8 + 8;  // IP, UDP, stream protocol
  const auto block = static_cast<std::size_t>(packetSize_bytes - kHeaders_bytes);
  std::uint32_t packet = 1;
  for (std::size_t at = 0; at < data.size(); at += block, ++packet) {
    Packet payload = header(kPayload, packet);
    const std::size_t size = std::min(block, data.size() - at);
    payload.bytes.insert(payload.bytes.end(), data.begin() + static_cast<std::ptrdiff_t>(at),
                         data.begin() + static_cast<std::ptrdiff_t>(at + size));
    send(payload.bytes);
  }
  send(header(kTrailer, packet).u16(0).u16(1).u32(static_cast<std::uint32_t>(height)).bytes);
}

}  // namespace tractiond::test

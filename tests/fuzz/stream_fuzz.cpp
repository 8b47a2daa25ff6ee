// Packets from the camera's own address, through the kernel's filter into Aravis: [length, two bytes][packet] ...
#include "daemon/capture/aravis_driver.h"
#include "daemon/capture/camera.h"
#include "tests/fuzz/target.h"
#include "tests/support/places.h"
#include "tests/unit/capture/gv_transmitter.h"
#include "tests/unit/capture/own_network.h"

#include <arpa/inet.h>
#include <sys/socket.h>

#include <atomic>
#include <chrono>
#include <thread>

namespace fuzz {
namespace {

using namespace tractiond;
using std::chrono::milliseconds;

constexpr int kWidth = 64, kHeight = 48;
constexpr std::uint32_t kRgb8Code = 0x02180014, kStreamPort = 0xd00;

class Stream {
 public:
  Stream() {
    capture::CameraOptions options;
    options.id = "127.0.0.1";
    options.packetSize_bytes = 1500;
    options.buffers = 30;
    sender_.write(0x100, kWidth);
    sender_.write(0x104, kHeight);
    sender_.write(0x128, kRgb8Code);
    std::atomic<bool> open{false};
    std::thread prelude([&] {  // the driver waits for a first whole frame
      for (; !open; std::this_thread::sleep_for(milliseconds(2))) {
        if (sender_.streaming()) shoot();
      }
    });
    auto camera = capture::Camera::open(capture::fromAravis(options), {.wait = false, .silenceTimeout_ms = 0}, ledger_);
    open = true;
    prelude.join();
    require(camera.has_value(), "the camera cannot be opened");
    camera_ = *std::move(camera);
    to_.sin_family = AF_INET;
    to_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  }

  void send(std::string_view packet) {
    to_.sin_port = htons(static_cast<std::uint16_t>(sender_.read(kStreamPort)));
    sendto(socket_, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to_), sizeof to_);
  }

  /// Whether anything came.
  bool take(milliseconds timeout) {
    Frame frame;
    const auto next = camera_->next(frame, timeout);
    if (frame.token != nullptr) camera_->recycle(frame);
    return next == capture::Next::kFrame || next == capture::Next::kRejected;
  }

  /// \param further what else the camera has sent meanwhile: more than Aravis takes for late
  void shoot(int further = 0) {
    id_ = static_cast<std::uint16_t>(1 + (id_ + further) % 65'535);
    sender_.send({.id = id_,
                  .width = kWidth,
                  .height = kHeight,
                  .format = kRgb8Code,
                  .bytes = std::vector<std::uint8_t>(3 * kWidth * kHeight)});
  }

  void requireThatItGoesOn() {
    for (int i = 0; i < 300; ++i, id_ = static_cast<std::uint16_t>(id_ + 100)) {
      shoot();
      if (take(milliseconds(20))) return;
    }
    require(false, "no picture comes any more");
  }

 private:
  test::GvTransmitter sender_{tractiond::test::source("tests/unit/capture/descriptions/quirky.xml")};
  Ledger ledger_;
  std::unique_ptr<capture::Camera> camera_;
  int socket_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in to_{};
  std::uint16_t id_ = 0;
};

std::string packet(std::uint8_t kind, std::uint16_t frame, std::uint32_t number, std::size_t body) {
  std::string bytes = {0,
                       0,
                       static_cast<char>(frame >> 8),
                       static_cast<char>(frame),
                       static_cast<char>(kind),
                       static_cast<char>(number >> 16),
                       static_cast<char>(number >> 8),
                       static_cast<char>(number)};
  bytes.resize(8 + body);
  if (kind == 1 && body >= 4) bytes[11] = 1;
  const std::string length = {static_cast<char>(bytes.size() >> 8), static_cast<char>(bytes.size())};
  return length + bytes;
}

}  // namespace

void begin(int argc, char** argv) {
  test::enterOwnNetwork(argc, argv);
}

std::vector<std::string> seeds() {
  std::string frame = packet(1, 7, 0, 36);
  for (std::uint32_t i = 1; i <= 7; ++i) frame += packet(3, 7, i, i < 7 ? 1464 : 432);
  return {frame + packet(2, 7, 8, 8),
          packet(2, 9, 0xfffffe, 8) + packet(7, 9, 1, 7) + packet(2, 9, 0, 8) + packet(0x82, 9, 1, 12),
          packet(3, 65535, 3, 100) + packet(1, 65535, 0, 36) + packet(3, 1, 1, 1464)};
}

bool feed(std::string_view bytes) {
  static Stream stream;
  static int fed = 0;
  while (bytes.size() > 2) {
    const std::size_t length = static_cast<std::uint8_t>(bytes[0]) << 8 | static_cast<std::uint8_t>(bytes[1]);
    const std::string_view packet = bytes.substr(2, length);
    stream.send(packet);
    bytes.remove_prefix(2 + packet.size());
  }
  while (stream.take(milliseconds(0))) {
  }
  // Where none of many frames is whole, the camera is opened again.
  if (fed % 4 == 0) stream.shoot(101);
  if (++fed % 1000 == 0) stream.requireThatItGoesOn();
  return true;  // nobody says
}

}  // namespace fuzz

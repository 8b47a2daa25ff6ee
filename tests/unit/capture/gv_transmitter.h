// A GigE Vision camera of which every byte on the wire is the test's: control as a camera answers it, pictures as the
// test sends them. Aravis's own fake camera has a good clock and no chunk data.
#pragma once

#include "tests/support/seed.h"

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

struct _ArvFakeCamera;

namespace tractiond::test {

class GvTransmitter {
 public:
  /// Listens at 127.0.0.1; `description` is a GenICam file.
  explicit GvTransmitter(const std::string& description);
  ~GvTransmitter();

  std::uint32_t read(std::uint32_t address) const;
  void write(std::uint32_t address, std::uint32_t value);
  /// A client has started the acquisition and said where pictures go.
  bool streaming() const;

  struct Picture {
    std::uint16_t id = 1;
    std::uint64_t device_ticks = 0;  ///< of 1 ns
    std::uint16_t payloadType = 1;   ///< 1: picture; 0x4001: picture with chunk data; 4: chunk data, and others
    int width = 0, height = 0;
    std::uint32_t format = 0;
    std::vector<std::uint8_t> bytes = {};          ///< with what lies behind the picture
    int x = 0, y = 0, paddingX = 0, paddingY = 0;  ///< as the leader says
    std::uint8_t dataKind = 3;  ///< content type of the data packets: 6 of multi-zone, 7 of multi-part, 8 of GenDC
  };
  void send(const Picture& picture);

  /// Its data packets have a multiple of so many bytes, fewer than it is asked for.
  std::atomic<int> roundsTo_bytes{1};

  /// A link that loses this share of the stream's packets, those sent again too.
  std::atomic<double> loss{0.0};
  /// Packets are sent again when they are asked for; one that has not been sent yet it says it does not have, or says
  /// nothing.
  std::atomic<bool> resends{false}, saysUnavailable{false};
  /// How a frame's packets are spread: called before each of them, with its number from 0 to `count` - 1.
  std::function<void(std::size_t number, std::size_t count)> pace;

  /// Its own clock: nanoseconds of CLOCK_MONOTONIC_RAW that run too fast by `clockRate`, since setClock(); in ticks of
  /// the frequency in its registers. A write to its control register latches it.
  std::uint64_t ticks() const;
  void setClock(std::int64_t shows_ns);
  std::atomic<double> clockRate{0.0};

  /// The camera takes so long for commands in registers that clear themselves (UserSetLoad).
  std::atomic<int> commandTakes_ms{0};
  /// From a write to this register on it answers no more, as one that hangs. 0: never.
  std::atomic<std::uint32_t> hangsAt{0};
  /// It denies writes to this register. 0: to none.
  std::atomic<std::uint32_t> locksAt{0};
  /// It acknowledges writes to this register, and does not make them. 0: it makes all.
  std::atomic<std::uint32_t> ignoresAt{0};

 private:
  using Packets = std::vector<std::vector<std::uint8_t>>;

  void serve();
  void sendOne(const std::vector<std::uint8_t>& packet);
  void sendAgain(std::uint16_t id, std::uint32_t first, std::uint32_t last);
  Packets packetsOf(const Picture& picture) const;

  std::mutex sending_;
  std::deque<std::pair<std::uint16_t, Packets>> sent_;  ///< of the last frames by their ids, what has been sent
  std::mt19937_64 fate_{seed() + 1};                    ///< seed() itself is the test's

  std::atomic<std::int64_t> clockSet_ns_{0}, clockShowed_ns_{0};

  _ArvFakeCamera* camera_;
  int control_, stream_;
  std::atomic<bool> ending_{false}, hanging_{false};
  std::thread thread_;
};

}  // namespace tractiond::test

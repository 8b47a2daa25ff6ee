// Pictures as a camera takes them, and the gate that judges them.
#pragma once

#include "daemon/capture/frame_gate.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace tractiond::capture {

inline constexpr std::int64_t kPeriod_ns = 16'666'667;
inline constexpr PictureShape kShape{640, 480, 640 * 480 * 3, 0x02180014};

/// A camera that counts and dates honestly until it is told otherwise, and a host some way behind it.
class SimulatedCamera {
 public:
  explicit SimulatedCamera(std::uint64_t firstId, bool wide = false)
      : id_(firstId)
      , wide_(wide) {}

  /// Takes a picture; what becomes of it is the test's business.
  Arrival take() {
    Arrival arrival;
    arrival.complete = true;
    arrival.shape = kShape;
    arrival.id = id_;
    arrival.device_ns = device_ns_;
    arrival.host_ns = std::max(host_ns_ + delay_ns_, lastArrival_ns_);
    lastArrival_ns_ = arrival.host_ns;
    pass(kPeriod_ns);
    id_ = wide_ || id_ < 65535 ? id_ + 1 : 1;
    return arrival;
  }
  void lose(int frames) {
    for (int i = 0; i < frames; ++i) take();
  }
  void pass(std::int64_t time_ns) {
    device_ns_ += time_ns;
    host_ns_ += time_ns;
  }
  void count(std::uint64_t id) { id_ = id; }
  void setClock(std::int64_t device_ns) { device_ns_ = device_ns; }
  void step(std::int64_t time_ns) { device_ns_ += time_ns; }
  void delay(std::int64_t delay_ns) { delay_ns_ = delay_ns; }
  std::int64_t hostNow() const { return std::max(host_ns_, lastArrival_ns_); }
  std::uint64_t nextId() const { return id_; }

 private:
  std::uint64_t id_;
  bool wide_;
  std::int64_t device_ns_ = 7'000'000'000'000;
  std::int64_t host_ns_ = 1'000'000'000;
  std::int64_t delay_ns_ = 500'000;
  std::int64_t lastArrival_ns_ = 0;
};

class FrameGateTest : public testing::Test {
 protected:
  Judgement judge(const Arrival& arrival) {
    const Judgement judgement = gate_.judge(arrival);
    count(judgement, ledger_);
    return judgement;
  }
  /// Judges `frames` honest ones and expects all of them to be new.
  void stream(SimulatedCamera& camera, int frames) {
    for (int i = 0; i < frames; ++i) ASSERT_EQ(judge(camera.take()).verdict, Verdict::kNew) << i;
  }
  FrameGate gate_{kShape, {}};
  Ledger ledger_;
};

}  // namespace tractiond::capture

// Records with a different number in every place, a subscriber that knows nothing of the publisher, and a clock.
#pragma once

#include "daemon/publish/publisher.h"
#include "tests/support/deadline.h"

#include <zmq.hpp>

#include <atomic>
#include <deque>
#include <numeric>

namespace tractiond::publish {

inline constexpr int kMarkers = 1152;
inline constexpr int kNodes = 576;

inline Id idOf(std::uint8_t first) {
  Id id;
  std::iota(id.begin(), id.end(), first);
  return id;
}

inline std::string text(const Id& id) {
  return {id.begin(), id.end()};
}

inline FrameInfo frameInfo(std::uint64_t number) {
  FrameInfo info;
  info.cameraFrameId = number % 65535 + 1;
  info.frameNumber = number;
  info.exposure_s = 0.004;
  info.times.device_ns = 777'000'000 + static_cast<std::int64_t>(number);
  info.times.received_ns = 1'000'000'000;
  info.times.receivedReal_ns = 1'700'000'000'000'000'001;
  info.times.captured_ns = 990'000'000;
  info.times.capturedError_ns = 12'345;
  info.times.capturedBound = CaptureBound::kBoth;
  info.times.tracked_ns = 1'000'200'000;
  info.times.solved_ns = 1'000'350'000;
  return info;
}

inline TractionField traction(int markers, int nodes, std::uint64_t number = 1) {
  TractionField field;
  field.resize(markers, nodes);
  field.markers.info = frameInfo(number);
  std::iota(field.markers.displacement_px.begin(), field.markers.displacement_px.end(), 0.5F);
  std::iota(field.markers.variance_px2.begin(), field.markers.variance_px2.end(), 0.25F);
  std::fill(field.markers.valid.begin(), field.markers.valid.end(), std::uint8_t{1});
  field.markers.valid.back() = 0;
  field.markers.validCount = markers - 1;
  field.markers.flags = kZeroUnverified | kReacquiring;
  field.markers.zero = idOf(100);
  std::iota(field.force_N.begin(), field.force_N.end(), 0.125F);
  field.valid = true;
  field.resultant_N = {1.0, 2.0, 3.0};
  field.moment_Nm = {4.0, 5.0, 6.0};
  field.centreOfPressure_m = {7.0, 8.0};
  field.centreOfPressureValid = true;
  for (std::size_t i = 0; i < 36;
       ++i) {  // 11 to 16, 21 to 26 ...: row and column; not symmetric, so each has its place
    field.noise[i] = static_cast<double>(10 * (i / 6 + 1) + i % 6 + 1);
    field.systematic[i] = 100.0 + field.noise[i];
  }
  field.residual_px = 9.0;
  std::iota(field.deviation_N.begin(), field.deviation_N.end(), 0.0625F);
  field.method = Method::kContact;
  field.pictureMotion = {11.0, 12.0, 13.0, 14.0};
  field.contacts[0] = {{1, 2},       {3, 4},      {5, 6, 7},        {8, 9, 10}, 11,       12, 13,
                       {14, 15, 16}, field.noise, field.systematic, {17, 18},   {19, 20}, 21, 22};
  field.contacts[1] = {{23, 24},     {25, 26},    {27, 28, 29},     {30, 31, 32}, 33,       34, 35,
                       {36, 37, 38}, field.noise, field.systematic, {39, 40},     {41, 42}, 43, 44};
  field.contacts[0].hertzRadius_m = 45.0;
  field.contacts[0].hertzRadiusDeviation_m = 46.0;
  field.contactCount = 2;
  field.flags = kZeroUnverified;
  return field;
}

inline Description description() {
  Description description;
  description.identity = {"gel-1", idOf(10), idOf(20)};
  description.message.mutable_camera()->set_serial("42");
  return description;
}

/// Of two markers, one of them not seen.
inline RestPose restPose() {
  RestPose pose;
  pose.position_px = {1.0F, 2.0F, 3.0F, 4.0F};
  pose.amplitude = {90.0F, 80.0F};
  pose.present = {1, 0};
  pose.noise = 2.5F;
  pose.taken_ns = 1'650'000'000'000'000'000;
  pose.requested = true;
  pose.id = idOf(50);
  return pose;
}

/// Time stands still unless a test moves it.
struct TestClock {
  static inline std::atomic<std::int64_t> now_ns{5'000'000'000};
  static std::int64_t monotonic() { return now_ns; }
  static std::int64_t real() { return 1'700'000'000'000'000'000 + now_ns; }
  static void advance(std::chrono::milliseconds time) { now_ns += std::chrono::nanoseconds(time).count(); }
};

inline PublishOptions options(std::vector<std::string> stream = {"tcp://127.0.0.1:*"},
                              std::vector<std::string> latest = {"tcp://127.0.0.1:*"}) {
  PublishOptions options;
  options.stream = std::move(stream);
  options.latest = std::move(latest);
  options.monotonicClock = TestClock::monotonic;
  options.realClock = TestClock::real;
  return options;
}

struct Parts {
  std::string topic, payload, time;
};

/// A plain SUB socket.
class TestSubscriber {
 public:
  TestSubscriber(const std::string& endpoint, const std::string& topic, int highWaterMark = 1000) {
    socket_.set(zmq::sockopt::linger, 0);
    socket_.set(zmq::sockopt::rcvhwm, highWaterMark);
    socket_.connect(endpoint);
    socket_.set(zmq::sockopt::subscribe, topic);
  }

  zmq::socket_t& socket() { return socket_; }

  /// Empty topic: nothing came within the time.
  Parts receive(int timeout_ms = test::kHung_ms) {
    std::array<std::string, 3> parts;
    socket_.set(zmq::sockopt::rcvtimeo, timeout_ms);
    for (std::size_t i = 0;; ++i) {
      zmq::message_t message;
      if (!socket_.recv(message)) return {};
      parts.at(i) = message.to_string();
      if (!message.more()) return {parts[0], parts[1], parts[2]};
    }
  }

 private:
  zmq::context_t context_{1};
  zmq::socket_t socket_{context_, zmq::socket_type::sub};
};

}  // namespace tractiond::publish

#include "daemon/capture/intake.h"

#include "base/clock.h"

#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cstring>

namespace tractiond::capture {
namespace {

/// Of 64 places all over the picture: the noise of a sensor alone makes it another in every picture.
std::uint64_t contentOf(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kPlaces = 64;
  std::array<std::uint64_t, kPlaces> sample{};
  if (size < sizeof sample) return XXH3_64bits(data, size);
  const std::size_t step = (size - sizeof(std::uint64_t)) / (kPlaces - 1);
  for (std::size_t i = 0; i < kPlaces; ++i) std::memcpy(&sample[i], data + i * step, sizeof sample[i]);
  return XXH3_64bits(sample.data(), sizeof sample);
}

/// Of a picture, from its first row to the end of its last [bytes].
std::size_t sizeOf(const CameraInfo& info, int stride) {
  const PixelFormatTraits& format = traitsOf(info.format);
  if (stride == 0) return info.shape.size;
  return static_cast<std::size_t>(stride) * static_cast<std::size_t>(info.shape.height - 1) +
         format.size(info.shape.width, 1);
}

}  // namespace

void Intake::begin(const CameraInfo& info, int buffers) {
  session_ = info.session;
  clock_.learn({});
  if (gate_) return gate_->restart();
  FrameGate::Options options;
  options.zeroIsAnId = info.zeroIsAnId;
  options.memory = std::max(options.memory, static_cast<std::size_t>(buffers) + 64);
  gate_.emplace(info.shape, options);
}

Judgement Intake::admit(const Buffer& buffer, Driver& driver, Frame& frame) {
  Arrival arrival = buffer.arrival;
  const std::int64_t real_ns = realNow();
  if (arrival.complete && buffer.data != nullptr) arrival.content = contentOf(buffer.data, arrival.shape.size);
  const Judgement judgement = gate_->judge(arrival);
  count(judgement, ledger_);
  if (judgement.verdict != Verdict::kNew) return judgement;
  if (driver.takeClock(asked_)) clock_.learn(asked_);
  const DeviceClock::Moment captured = clock_.add(arrival, judgement, buffer.awaited);

  const CameraInfo& info = driver.info();
  frame = Frame{};
  frame.info.cameraFrameId = arrival.id;
  frame.info.frameNumber = judgement.frameNumber;
  frame.info.exposure_s = buffer.extras.exposure_s > 0 ? buffer.extras.exposure_s : info.exposure_s;
  frame.info.extras = buffer.extras;
  frame.info.discontinuity = judgement.discontinuity;
  frame.info.doubted = judgement.doubted;
  frame.info.times.device_ns = arrival.device_ns;
  frame.info.times.received_ns = arrival.host_ns;
  frame.info.times.receivedReal_ns = real_ns;
  frame.info.times.captured_ns = captured.captured_ns;
  frame.info.times.capturedError_ns = captured.error_ns;
  frame.info.times.capturedBound = captured.bound;
  frame.data = buffer.data;
  frame.size = sizeOf(info, buffer.stride);
  frame.width = arrival.shape.width;
  frame.height = arrival.shape.height;
  frame.stride = buffer.stride;
  frame.format = info.format;
  frame.token = buffer.handle;
  frame.session = session_;
  return judgement;
}

}  // namespace tractiond::capture

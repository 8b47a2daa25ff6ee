#include "daemon/camera_source.h"

#include "daemon/base/clock.h"

#include <poll.h>
#include <spdlog/spdlog.h>

#include <string>
#include <utility>

namespace tractiond {
namespace {

constexpr std::int64_t kBetweenTries_ns = 1'000'000'000;

void describe(const capture::CameraInfo& info) {
  std::string text = fmt::format("camera {}: {} x {}", info.name.id, info.width, info.height);
  if (info.frameRate_Hz > 0) text += fmt::format(", {:.4g} frames/s", info.frameRate_Hz);
  if (info.packetSize_bytes > 0) {
    text += fmt::format(", packets of {} bytes{}, receive buffer {} bytes, {} socket", info.packetSize_bytes,
                        info.packetSizeVerified ? "" : " (no frame seen yet)", info.receiveBuffer_bytes,
                        info.packetSocket ? "packet" : "normal");
  }
  spdlog::info(text);
  for (const std::string& setting : info.settings) spdlog::info("camera: {}", setting);
  for (const std::string& warning : info.warnings) spdlog::warn("warning: {}", warning);
}

}  // namespace

CameraSource::CameraSource(const capture::CameraOptions& options, Ledger& ledger, Welcome welcome)
    : wait_(options.wait)
    , options_(options)
    , ledger_(ledger)
    , welcome_(std::move(welcome)) {
  options_.wait = false;  // waiting is done here, between turns of the capture stage
}

tl::expected<std::unique_ptr<CameraSource>, Error> CameraSource::open(const capture::CameraOptions& options,
                                                                      Ledger& ledger, Welcome welcome) {
  std::unique_ptr<CameraSource> source(new CameraSource(options, ledger, std::move(welcome)));
  if (auto opened = source->tryOpen(); !opened) {
    if (!source->wait_ || opened.error().exitCode != EX_UNAVAILABLE) return tl::unexpected(opened.error());
    spdlog::info("waiting for a camera: {}", opened.error().message());
    source->state_ = publish::CameraState::kWaiting;
  }
  return source;
}

tl::expected<void, Error> CameraSource::tryOpen() {
  nextTry_ns_ = monotonicNow() + kBetweenTries_ns;
  auto camera = capture::AravisCamera::open(options_, ledger_, stop_.get_token(),
                                            [](const std::string& remark) { spdlog::warn("warning: {}", remark); });
  if (!camera) return tl::unexpected(camera.error());
  if (auto welcomed = welcome_((*camera)->info()); !welcomed) return welcomed;
  describe((*camera)->info());
  camera_ = *std::move(camera);
  // release: partner is the acquire in info().
  info_.store(&camera_->info(), std::memory_order_release);
  state_.store(publish::CameraState::kStreaming, std::memory_order_relaxed);
  return {};
}

capture::Next CameraSource::next(Frame& frame, std::chrono::milliseconds timeout) {
  if (camera_) {
    const auto next = camera_->next(frame, timeout);
    state_.store(camera_->lost() ? publish::CameraState::kLost : publish::CameraState::kStreaming,
                 std::memory_order_relaxed);
    return next;
  }
  if (monotonicNow() < nextTry_ns_) {
    poll(nullptr, 0, static_cast<int>(timeout.count()));
    return capture::Next::kTimeout;
  }
  const auto opened = tryOpen();
  if (!opened && opened.error().exitCode != EX_UNAVAILABLE && !stop_.stop_requested()) {
    error_ = opened.error();
    return capture::Next::kEnd;
  }
  return capture::Next::kTimeout;
}

void CameraSource::recycle(Frame& frame) {
  if (camera_) camera_->recycle(frame);
}

}  // namespace tractiond

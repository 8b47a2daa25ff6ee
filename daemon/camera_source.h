// The camera as the pipeline's source, also while it is not there yet.
#pragma once

#include "daemon/base/error.h"
#include "daemon/capture/aravis_camera.h"
#include "daemon/publish/status.h"

#include <tl/expected.hpp>

#include <atomic>
#include <functional>
#include <memory>
#include <stop_token>

namespace tractiond {

/// As a FrameSource bound to the capture thread; the other functions are thread-safe.
class CameraSource : public capture::FrameSource {
 public:
  /// Called once, when the camera has been opened and before its first frame. Its error is open()'s or next()'s.
  using Welcome = std::function<tl::expected<void, Error>(const capture::CameraInfo&)>;

  /// Looks for the camera once. One that is not there is waited for within next(), if the options say so; all else that
  /// keeps it from being opened is an error. The ledger outlives the source.
  static tl::expected<std::unique_ptr<CameraSource>, Error> open(const capture::CameraOptions& options, Ledger& ledger,
                                                                 Welcome welcome);

  /// kEnd when the awaited camera cannot be used: see error().
  capture::Next next(Frame& frame, std::chrono::milliseconds timeout) override;
  void recycle(Frame& frame) override;

  /// Lets next() come back from opening a camera that somebody else still holds.
  void stop() { stop_.request_stop(); }

  publish::CameraState state() const { return state_.load(std::memory_order_relaxed); }

  /// nullptr: not opened yet.
  const capture::CameraInfo* info() const { return info_.load(std::memory_order_acquire); }

  /// After kEnd.
  const Error& error() const { return error_; }

 private:
  CameraSource(const capture::CameraOptions& options, Ledger& ledger, Welcome welcome);
  tl::expected<void, Error> tryOpen();

  const bool wait_;
  capture::CameraOptions options_;
  Ledger& ledger_;
  Welcome welcome_;
  std::stop_source stop_;
  std::unique_ptr<capture::AravisCamera> camera_;
  std::int64_t nextTry_ns_ = 0;
  Error error_;
  std::atomic<publish::CameraState> state_{publish::CameraState::kUnknown};
  std::atomic<const capture::CameraInfo*> info_{nullptr};
};

}  // namespace tractiond

// Processing without a gel file: shows the camera's pictures, and measures nothing.
#pragma once

#include "daemon/app/processing.h"
#include "daemon/control/snapshots.h"

#include <string_view>

namespace tractiond {

/// Accepts every camera, picture size and format that can be streamed. Tracks no frame: each is counted as
/// Ledger::noGel.
class NoGel : public Processing {
 public:
  /// \param replies outlives this
  explicit NoGel(control::Replies& replies)
      : replies_(replies)
      , snapshots_(&replies) {}

  /// Text of the status that explains this to an operator.
  static const std::string_view kWhy;

  // These implement Processing, which names the thread of each. track() copies the picture if a snapshot is wanted, and
  // returns false; turn() answers requests for snapshots; beginZero() and beginStep() refuse; measure() sets the remark
  // kWhy. The functions with an empty body do nothing.
  PipelineOptions pipelineOptions() const override { return {.notTracked = &Ledger::noGel}; }
  tl::expected<void, Error> acceptCamera(const capture::CameraInfo& /*info*/) override { return {}; }
  bool track(const Frame& frame, MarkerField& markers) override;
  void solve(const MarkerField& /*markers*/, TractionField& /*field*/) override {}
  void takeField(const TractionField& /*field*/) override {}
  void measure(traction::v1::Status& status) override;
  void beginSession(const capture::CameraInfo& info) override { snapshots_.setCamera(info.shape.size, info.waits()); }
  void beginZero(const ZeroRequest& request) override;
  void beginStep(const CalibrationStep& step) override;
  void askSnapshot() override { snapshots_.ask(); }
  void turn() override;
  bool hurried() const override { return false; }
  tl::expected<void, Error> finish() override { return {}; }

 private:
  control::Replies& replies_;
  control::Snapshots snapshots_;
};

}  // namespace tractiond

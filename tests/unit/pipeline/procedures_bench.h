// The procedures with a clock that is set and a tracker that does as it is told.
#pragma once

#include "daemon/procedures.h"

#include <vector>

namespace tractiond {

/// The tracker's side of a zero.
struct FakeTracker {
  track::ZeroState state = track::ZeroState::kNone;
  std::optional<RestPose> finished;

  void finish(const RestPose& pose) {
    finished = pose;
    state = track::ZeroState::kTaken;
  }
};

struct ProceduresBench {
  ProceduresBench() { now_ns = 1'000'000'000; }

  RestPose pose(std::uint8_t id, bool requested) const {
    RestPose pose;
    const auto count = static_cast<std::size_t>(sensor.markerCount());
    pose.position_px.resize(2 * count);
    pose.amplitude.assign(count, 50.0F);
    pose.present.assign(count, 1);
    pose.requested = requested;
    pose.id[0] = id;
    return pose;
  }

  static CalibrationStep noise(double seconds) {
    CalibrationStep step;
    step.kind = CalibrationStep::Kind::kNoise;
    step.seconds = seconds;
    return step;
  }

  void pass(std::int64_t ms) { now_ns += 1'000'000 * ms; }
  void turn() { procedures.turn(); }

  static inline std::int64_t now_ns = 0;  ///< what the clock says

  sensor::Sensor sensor;
  Counter frames;
  Mailbox<MarkerField> markers;
  Mailbox<RestDrift> drift;
  FakeTracker tracker;
  std::string doubt;
  bool keepFails = false;

  int judged = 0;
  std::optional<RestPose> described, kept;
  std::vector<tl::expected<RestPose, std::string>> zeroAnswers;
  std::string remark;
  std::vector<calibrate::Result> stepAnswers;

  Procedures procedures{sensor,
                        {.directory = "/nowhere", .clock = [] { return now_ns; }},
                        {.frames = frames,
                         .markers = markers,
                         .drift = drift,
                         .requestZero = [this] { tracker.state = track::ZeroState::kRequested; },
                         .zeroState = [this] { return tracker.state; },
                         .takeRestPose =
                             [this](RestPose& pose) {
                               const bool there = tracker.finished.has_value();
                               if (there) pose = *std::exchange(tracker.finished, std::nullopt);
                               return there;
                             },
                         .judge =
                             [this](const RestPose&) {
                               ++judged;
                               return doubt;
                             },
                         .describe = [this](const RestPose& pose) { described = pose; },
                         .keep = [this](const RestPose& pose) -> tl::expected<void, Error> {
                           if (keepFails) return tl::unexpected(Error{.what = "the disk is full"});
                           kept = pose;
                           return {};
                         },
                         .answerZero =
                             [this](const auto& result, const std::string& said) {
                               zeroAnswers.push_back(result);
                               remark = said;
                             },
                         .answerCalibration = [this](const auto& result) { stepAnswers.push_back(result); }}};
};

}  // namespace tractiond

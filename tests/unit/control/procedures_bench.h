// The procedures with a clock that is set and a tracker that does as it is told.
#pragma once

#include "daemon/control/procedures.h"

#include <deque>
#include <future>
#include <vector>

namespace tractiond::control {

/// The tracker's side of a zero, with a tracker's promises: nothing comes of what was taken back.
struct FakeTracker final : track::ZeroTracker {
  track::ZeroState state = track::ZeroState::kNone;
  std::optional<RestPose> finished, adopted;

  bool asked() const { return state == track::ZeroState::kRequested || state == track::ZeroState::kTaking; }

  void finish(const RestPose& pose) {
    finished = pose;
    state = track::ZeroState::kTaken;
  }

  void requestZero() override { state = track::ZeroState::kRequested; }
  bool cancelZero() override {
    const bool was = asked();
    if (was) state = track::ZeroState::kNone;
    return was;
  }
  track::ZeroState zeroState() const override { return state; }
  bool takeRestPose(RestPose& pose) override {
    const bool there = finished.has_value();
    if (there) pose = *std::exchange(finished, std::nullopt);
    return there;
  }
  bool putInForce(const RestPose& pose, bool /*fits*/) override {
    adopted = pose;
    return true;
  }
};

struct ProceduresBench final : GelComparison, ProcedureHost, Replies {
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

  /// Does the work of a calibration step that was started first.
  void doWork() {
    works.front()();
    works.pop_front();
  }

  void pass(std::int64_t ms) { now_ns += 1'000'000 * ms; }
  void turn() { procedures.turn(); }

  static inline std::int64_t now_ns = 0;  ///< what the clock says

  sensor::Sensor sensor;
  Counter frames;
  Mailbox<MarkerField> markers;
  Mailbox<Watched> watched;
  FakeTracker tracker;
  std::string doubt;

  using Kept = tl::expected<void, Error>;
  std::deque<std::packaged_task<std::optional<calibrate::Result>()>> works;  ///< that have been started
  bool workTakesLong = false;                                                ///< doWork() does it
  int comparisons = 0;
  std::optional<RestPose> described, kept, keptBefore;
  std::vector<tl::expected<RestPose, std::string>> zeroAnswers;
  std::string remark;
  std::vector<calibrate::Result> stepAnswers;

  GelReport compare(const RestPose& /*pose*/) override {
    ++comparisons;
    GelReport report;
    report.remark = doubt;
    return report;
  }
  void report(const RestPose& /*pose*/, const GelReport& /*report*/) override {}

  void describe(const RestPose& pose) override { described = pose; }
  std::future<Kept> keep(const RestPose& pose, const RestPose* before) override {
    kept = pose;
    keptBefore = before ? std::optional(*before) : std::nullopt;
    std::promise<Kept> done;
    done.set_value({});
    return done.get_future();
  }
  std::future<std::optional<calibrate::Result>> start(StepWork work) override {
    works.emplace_back(std::move(work));
    auto done = works.back().get_future();
    if (!workTakesLong) doWork();
    return done;
  }

  void answerZero(const tl::expected<RestPose, std::string>& result, const std::string& said) override {
    zeroAnswers.push_back(result);
    remark = said;
  }
  void answerCalibration(const calibrate::Result& result) override { stepAnswers.push_back(result); }
  void answerSnapshot(const tl::expected<const Snapshot*, std::string>& /*result*/,
                      const std::vector<sensor::MarkerLayer>& /*layers*/) override {}

  Procedures procedures{{.sensor = sensor,
                         .frames = frames,
                         .markers = markers,
                         .watched = watched,
                         .tracker = tracker,
                         .gel = *this,
                         .host = *this,
                         .replies = *this},
                        {.zeroFrames = 30, .directory = "/nowhere", .clock = [] { return now_ns; }}};
};

}  // namespace tractiond::control

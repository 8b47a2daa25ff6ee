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
  bool adoptedFits = false;
  bool busy = false;

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
  bool putInForce(const RestPose& pose, bool fits) override {
    if (busy) return false;
    adopted = pose;
    adoptedFits = fits;
    return true;
  }
};

struct ProceduresBench final : GelComparison, ProcedureHost, Replies {
  explicit ProceduresBench(int averaged = 30, const sensor::Sensor& inForce = {})
      : zeroFrames(averaged)
      , sensor(inForce) {
    now_ns = 1'000'000'000;
  }

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

  /// A field of this moment in which nothing touches; with few markers, if so.
  void field(bool few = false) {
    MarkerField field;
    field.resize(sensor.markerCount());
    std::fill(field.valid.begin(), field.valid.end(), std::uint8_t{1});
    std::fill(field.variance_px2.begin(), field.variance_px2.end(), 3e-4F);
    field.validCount = sensor.markerCount();
    field.flags = few ? kFewMarkers : 0U;
    field.info.times.received_ns = now_ns;
    frames.add();
    markers.put(field);
  }

  double zeroWithin_s() {
    Watched now;
    watched.take(now);
    return now.zeroWithin_s;
  }

  /// The disk is done with what it was given first.
  void writeOne() {
    disk.front().set_value(keepFails ? Kept(tl::unexpected(Error{.what = "the disk is full"})) : Kept());
    disk.pop_front();
  }

  /// Does the work of a calibration step that was started first.
  void doWork() {
    works.front()();
    works.pop_front();
  }

  /// Zero 2 is in force, 1 was before it, and 3 is being written.
  void takeThirdZeroWhileTheDiskHangs() {
    procedures.welcome("Camera-1", 0.0, pose(2, true), pose(1, true));
    diskHangs = true;
    procedures.zero().begin({});
    tracker.finish(pose(3, true));
    turn();
  }

  void pass(std::int64_t ms) { now_ns += 1'000'000 * ms; }
  void turn() { procedures.turn(); }

  static inline std::int64_t now_ns = 0;  ///< what the clock says

  const int zeroFrames;
  sensor::Sensor sensor;
  Counter frames;
  Mailbox<MarkerField> markers;
  Mailbox<Watched> watched;
  FakeTracker tracker;
  std::string doubt;

  using Kept = tl::expected<void, Error>;
  std::deque<std::promise<Kept>> disk;  ///< what is being written
  bool keepFails = false, diskHangs = false;
  std::deque<std::packaged_task<std::optional<calibrate::Result>()>> works;  ///< that have been started
  bool workTakesLong = false;                                                ///< doWork() does it
  int comparisons = 0;
  Id reportedZero{};  ///< the zero that the status reports on
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
  void report(const RestPose& pose, const GelReport& /*report*/) override { reportedZero = pose.id; }

  void describe(const RestPose& pose) override { described = pose; }
  std::future<Kept> keep(const RestPose& pose, const RestPose* before) override {
    disk.emplace_back();
    auto done = disk.back().get_future();
    kept = pose;
    keptBefore = before ? std::optional(*before) : std::nullopt;
    if (!diskHangs) writeOne();
    return done;
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
                        {.zeroFrames = zeroFrames, .directory = "/nowhere", .clock = [] { return now_ns; }}};
};

}  // namespace tractiond::control

#include "tests/simulation/life.h"

#include <fmt/format.h>

#include <utility>

namespace tractiond::simulation {

using std::chrono_literals::operator""ms;

Life::Life(const Around& around)
    : around_(around)
    , start_(around.person.start())
    , solving_(around.gel, start_.config.prompt, around.modelling, around.starvation, around.ongoing, around.journal)
    , tracker_(around.gel)
    , truths_(kNumbers)
    , camera_(around.camera, start_.config.camera, ledger_, around.journal, around.starvation)
    , pipeline_(*this, *this, {.markers = around.gel.sensor.markerCount(), .nodes = around.gel.sensor.nodes.count()},
                ledger_, turns_)
    , hooks_(hooks())
    , supervisor_(hooks_, camera_, around.person, around.journal, around.starvation)
    , procedures_({.sensor = around.gel.sensor,
                   .frames = frames_,
                   .markers = newest_,
                   .watched = watched_,
                   .tracker = *this,
                   .gel = *this,
                   .host = *this,
                   .replies = *this},
                  {.zeroFrames = kZeroFrames, .directory = kState})
    , solveThread_(
          [this] { hasStageEnded_[static_cast<std::size_t>(Stage::kSolve)] = !pipeline_.turn(Stage::kSolve, 0ms); }) {
  around_.fields.begin();
  restored_ = around_.zeros.restore();
  if (restored_.zero) tracker_.restore(*restored_.zero);
}

/// What the control thread does before its turn: it restores the zeros when the first camera is open, as Instrument
/// does.
void Life::meetCamera() {
  if (hasMet_ || !camera_.hasOpened()) return;
  hasMet_ = true;
  procedures_.restore(kCamera, 60.0, restored_.zero, restored_.before);
}

void Life::solve(const MarkerField& markers, TractionField& field) {
  around_.journal.law(markers.info.frameNumber == tracked_, "the newest frame is solved",
                      [&] { return fmt::format("frame {}, while {} waits", markers.info.frameNumber, tracked_); });
  solving_.solve(markers, field);
  worked_ = true;
}

void Life::publish(const TractionField& field) {
  if (!field.valid) ledger_.invalid.add();
  around_.fields.check(field, truths_[field.markers.info.frameNumber % kNumbers]);
  worked_ = true;
}

void Life::control(std::chrono::milliseconds /*timeout*/) {
  camera_.takeAnswer();
  for (const Happening& one : std::exchange(asked_, {})) begin(one);
  meetCamera();
  procedures_.turn();
}

void Life::takeOver(const tl::expected<Reread, Error>& read) {
  if (!tractiond::takeOver(read, start_.config, start_.calibration, camera_.hasRefused())) return;
  camera_.reopen(start_.config.camera);
  around_.fields.disturb(now());
}

bool Life::takeRestPose(RestPose& pose) {
  const bool isThere = tracker_.takeRestPose(pose);
  if (isThere) around_.zeros.noteTaken(pose, tracker_.finishedPress_N());
  return isThere;
}

bool Life::putInForce(const RestPose& pose, bool /*fits*/) {
  if (around_.chance.oneIn(8)) return false;  // the tracking thread is just taking one
  tracker_.putInForce(pose);
  return true;
}

GelReport Life::compare(const RestPose& zero) {
  around_.zeros.noteCompared(zero);
  return {};
}

void Life::report(const RestPose& zero, const GelReport& /*report*/) {
  tracker_.setGelFits(zero.id);
}

void Life::begin(const Happening& one) {
  CalibrationStep step;
  switch (one.event) {
  case Event::kQuestion:
    if (!camera_.isAsked()) {
      CameraStep question;
      question.mutable_read()->set_name("Gain");
      camera_.ask(question);
    }
    return;
  case Event::kNoise:
    step.kind = CalibrationStep::Kind::kNoise;
    step.seconds = 1e-3 * static_cast<double>(one.amount);
    return beginStep(step);
  case Event::kFinish:
    step.kind = CalibrationStep::Kind::kFinish;
    return beginStep(step);
  default:
    break;
  }
  const ZeroRequest request{.anyway = one.event == Event::kZeroAnyway, .undo = one.event == Event::kUndo};
  ++around_.journal.result.zerosAsked;
  if (around_.askers.noteZero(zeroWithin_s(), request)) procedures_.zero().begin(request);
}

capture::Next Life::next(Frame& frame, std::chrono::milliseconds timeout) {
  const capture::Next next = camera_.next(frame, timeout);
  worked_ = next == capture::Next::kFrame || next == capture::Next::kRejected;
  if (next == capture::Next::kFrame) {
    const auto& picture = *static_cast<const Picture*>(frame.token);
    truths_[frame.info.frameNumber % kNumbers] = {picture.number, picture.taken};
  }
  return next;
}

bool Life::track(const Frame& frame, MarkerField& markers) {
  worked_ = true;
  const bool tracked = tracker_.track(*static_cast<const Picture*>(frame.token), markers);
  frames_.add();
  if (tracked) {
    newest_.put(markers);
    tracked_ = frame.info.frameNumber;
  }
  return tracked;
}

ServiceHooks Life::hooks() {
  return {.loops = loopsOf(turns_),
          .ended = [this] { return pipeline_.ended(); },
          .statusLine = [] { return std::string(); },
          .reload = [this] { return [this, read = around_.person.read()] { takeOver(read); }; },
          .others = [this] { return !camera_.isForsaken(); }};
}

bool Life::turn(Stage stage) {
  const auto index = static_cast<std::size_t>(stage);
  if (hasStageEnded_[index]) return false;
  worked_ = false;
  if (stage != Stage::kSolve) {
    hasStageEnded_[index] = !pipeline_.turn(stage, stage == Stage::kCapture ? 100ms : 0ms);
  } else if (!solveThread_.go()) {
    return false;
  }
  supervisor_.noteTurn(index);
  return worked_;
}

void Life::checkConfiguration() {
  if (supervisor_.isSettled() && camera_.isStreaming() && around_.fields.isCalm())
    around_.person.check(camera_.opened());
}

void Life::stop() {
  pipeline_.requestStop();
  solving_.stop();
  solveThread_.end();
  for (const Stage stage : {Stage::kCapture, Stage::kTrack, Stage::kSolve, Stage::kPublish}) {
    while (!hasStageEnded_[static_cast<std::size_t>(stage)]) turn(stage);
  }
  pipeline_.countDiscarded();
  checkBalance(0);
}

void Life::checkBalance(std::uint64_t inFlight) const {
  const std::uint64_t received = ledger_.received.get(), gone = ledger_.published.get() + ledger_.losses();
  around_.journal.law(gone <= received && received - gone <= inFlight, "received = published + named losses", [&] {
    return fmt::format("{} received, {} published, {} lost", received, ledger_.published.get(), ledger_.losses());
  });
}

void Life::checkEvictions(bool inBurst, bool solvesBurst) {
  constexpr std::int64_t kBridged_ns = 80 * kMs, kLately_ns = 500 * kMs;
  const std::int64_t starved_ns = around_.starvation.since(now() - kLately_ns);
  const std::uint64_t evicted = ledger_.evictedBeforeTrack.get() + ledger_.evictedBeforePublish.get();
  const std::uint64_t passedOver = ledger_.evictedBeforeSolve.get();
  const bool evicts = std::exchange(evicted_, evicted) != evicted;
  const bool passesOver = std::exchange(passedOver_, passedOver) != passedOver;
  around_.journal.law(!evicts || inBurst || starved_ns > kBridged_ns, "links bridge a stall of 80 ms",
                      [&] { return fmt::format("{} evicted", evicted); });
  const bool isWaiting = solving_.waited_ns() > now() - kLately_ns || waitsUntil_ns(Stage::kSolve) != 0;
  around_.journal.law(!passesOver || solvesBurst || isWaiting || starved_ns > 0,
                      "a solver that is fast enough solves every frame",
                      [&] { return fmt::format("{} evicted", passedOver); });
}

void Life::beginStep(const CalibrationStep& step) {
  around_.askers.noteStep(step, stepWithin_ns(step));
  procedures_.beginStep(step);
}

std::int64_t Life::stepWithin_ns(const CalibrationStep& step) const {
  constexpr std::int64_t kSlack_ns = 11 * kSecond, kDisk_ns = 1'000 * kSecond;
  if (step.kind != CalibrationStep::Kind::kNoise) return kDisk_ns;
  return kSlack_ns + static_cast<std::int64_t>(1e9 * (step.seconds + calibrate::Calibration::kGrace_s));
}

double Life::zeroWithin_s() {
  watched_.take(lastWatched_);
  return lastWatched_.zeroWithin_s;
}

}  // namespace tractiond::simulation

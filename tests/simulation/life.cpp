#include "tests/simulation/life.h"

#include <fmt/format.h>

namespace tractiond::simulation {

using std::chrono_literals::operator""ms;

Life::Life(const Around& around)
    : around_(around)
    , solver_(around.gel.inverse, around.gel.sensor, solving())
    , tracker_(around.gel)
    , truths_(kNumbers)
    , intake_(ledger_)
    , pipeline_(stages(), {.markers = around.gel.sensor.markerCount(), .nodes = around.gel.sensor.nodes.count()},
                ledger_, turns_)
    , procedures_(around.gel.sensor, {.zeroFrames = kZeroFrames, .directory = kState}, links()) {
  driver_.is.name.vendor = "Simulated";
  driver_.is.name.serial = "1";
  driver_.is.shape = around_.camera.shape();
  driver_.is.frameRate_Hz = 60.0;
  driver_.is.session = 1;
  intake_.begin(driver_.is, kBuffers);
  around_.fields.begin();
  const auto [zero, before] = around_.zeros.restore();
  if (zero) tracker_.restore(*zero);
  procedures_.welcome(kCamera, driver_.is.frameRate_Hz, zero, before);
}

/// The search for contacts takes most of the time.
solve::SolveOptions Life::solving() const {
  solve::SolveOptions options = around_.gel.options;
  options.contactAware = around_.searchesForContacts;
  return options;
}

Stages Life::stages() {
  return {.source = *this,
          .track = [this](const Frame& frame, MarkerField& markers) { return track(frame, markers); },
          .solve =
              [this](const MarkerField& markers, TractionField& field) {
                solver_.solve(markers, field);
                worked_ = true;
              },
          .publish =
              [this](const TractionField& field) {
                around_.fields.heed(field, truths_[field.markers.info.frameNumber % kNumbers]);
                worked_ = true;
              },
          .waitToPublish = [](int, auto) {},
          .control = [this](auto) { procedures_.turn(); }};
}

ProcedureLinks Life::links() {
  return {.frames = frames_,
          .markers = newest_,
          .watched = watched_,
          .requestZero = [this] { tracker_.request(); },
          .cancelZero = [this] { return tracker_.cancel(); },
          .zeroState = [this] { return tracker_.state(); },
          .takeRestPose = [this](RestPose& pose) { return tracker_.takeRestPose(pose); },
          .putInForce =
              [this](const RestPose& pose, bool /*fits*/) {
                if (around_.chance.oneIn(8)) return false;  // the tracking thread is just taking one
                tracker_.putInForce(pose);
                return true;
              },
          .judge = [](const RestPose&) { return GelReport(); },
          .tellJudgement = [this](const RestPose& pose, const GelReport&) { tracker_.judge(pose.id); },
          .describe = [this](const RestPose& pose) { around_.zeros.describe(pose); },
          .keep = [this](const RestPose& pose, const RestPose* before) { return around_.zeros.keep(pose, before); },
          .startWork =
              [](const calibrate::StepLinks::Work& work) {
                std::promise<std::optional<calibrate::Result>> done;
                done.set_value(work());
                return done.get_future();
              },
          .answerZero = [this](const auto& result, const std::string&) { around_.askers.heedZeroAnswer(result); },
          .answerCalibration = [this](const auto& result) { around_.askers.heedStepAnswer(result); }};
}

capture::Popped Life::Driver::pop(capture::Buffer& /*buffer*/, std::chrono::milliseconds /*timeout*/) {
  return capture::Popped::kNothing;  // next() gives buffers
}

capture::Next Life::next(Frame& frame, std::chrono::milliseconds /*timeout*/) {
  if (around_.camera.arrives_ns() > now()) return capture::Next::kTimeout;
  worked_ = true;
  const OnItsWay come = around_.camera.take();
  Picture& room = pictures_[nextPicture_++ % kPictures] = come.picture;
  capture::Buffer buffer;
  buffer.arrival = come.arrival;
  buffer.arrival.host_ns = buffer.arrival.raw_ns = now();
  buffer.data = room.bytes.data();
  buffer.handle = &room;
  buffer.awaited = !around_.camera.hasMore();
  if (intake_.judge(buffer, driver_, frame).verdict != capture::Verdict::kNew) return capture::Next::kRejected;
  truths_[frame.info.frameNumber % kNumbers] = {room.number, room.isForged};
  return capture::Next::kFrame;
}

bool Life::track(const Frame& frame, MarkerField& markers) {
  worked_ = true;
  const bool tracked = tracker_.track(*static_cast<const Picture*>(frame.token), markers);
  frames_.add();
  if (tracked) newest_.put(markers);
  return tracked;
}

bool Life::turn(Stage stage) {
  worked_ = false;
  pipeline_.turn(stage, 0ms);
  return worked_;
}

void Life::stop() {
  pipeline_.requestStop();
  for (const Stage stage : {Stage::kCapture, Stage::kTrack, Stage::kSolve, Stage::kPublish}) {
    while (pipeline_.turn(stage, 0ms)) {
    }
  }
  pipeline_.settle();
  checkBalance(0);
}

void Life::checkBalance(std::uint64_t inFlight) const {
  const std::uint64_t received = ledger_.received.get(), gone = ledger_.published.get() + ledger_.losses();
  around_.journal.law(
      gone <= received && received - gone <= inFlight, "received = published + named losses",
      fmt::format("{} received, {} published, {} lost", received, ledger_.published.get(), ledger_.losses()));
}

double Life::zeroWithin_s() {
  watched_.take(lastWatched_);
  return lastWatched_.zeroWithin_s;
}

}  // namespace tractiond::simulation

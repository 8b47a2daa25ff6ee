// Strategy. Each stage of the pipeline takes its turns when it has work and is not busy; which of those that are ready
// comes first is drawn. A stage's work takes effect at once and makes it busy for its time. Then time goes on to the
// next moment at which anything can happen.
#include "tests/simulation/simulation.h"

#include "daemon/base/clock.h"
#include "daemon/capture/intake.h"
#include "daemon/pipeline.h"
#include "daemon/procedures.h"
#include "daemon/solve/inverse_cache.h"
#include "daemon/solve/options.h"
#include "daemon/solve/solver.h"
#include "daemon/track/nominal.h"
#include "daemon/track/rest_pose.h"
#include "daemon/track/zero_store.h"
#include "tests/simulation/disk.h"

#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <deque>
#include <limits>
#include <map>
#include <set>
#include <utility>

namespace tractiond::simulation {
namespace {

constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();
constexpr std::int64_t kPeriod_ns = 16'666'667;
constexpr std::int64_t kUnderWay_ns = 9 * kMs;  // exposure, read-out and transport
constexpr int kZeroFrames = 10, kBuffers = 10;
constexpr double kNoise_px = 0.018;
constexpr std::int64_t kAlarm_ns = 300 * kMs;        // three pictures of the camera's own come, also of a lossy one
constexpr std::int64_t kContradicts_ns = 100 * kMs;  // since its last picture
constexpr std::size_t kNoises = 128, kPictures = 256, kNumbers = 4096;
constexpr const char* kCamera = "Simulated-1";
constexpr const char* kState = "/state";

/// What a picture shows, of which the laws know.
struct Picture {
  std::uint64_t number = 0;  ///< counted by nobody but the world
  std::int64_t taken_ns = 0;
  double force_N = 0.0;
  bool isFew = false;
  bool isForged = false;
  std::size_t noise = 0;
  std::array<std::uint8_t, 64> bytes{};
};

struct OnItsWay {
  std::int64_t at_ns = 0;
  capture::Arrival arrival;
  Picture picture;
};

std::string nameOf(const Id& id) {
  return fmt::format("{:02x}{:02x}{:02x}{:02x}", id[0], id[1], id[2], id[3]);
}

struct Driver : capture::Driver {
  capture::CameraInfo is;
  const capture::CameraInfo& info() const override { return is; }
  capture::Popped pop(capture::Buffer& /*buffer*/, std::chrono::milliseconds /*timeout*/) override {
    return capture::Popped::kNothing;
  }
  void giveBack(void* /*handle*/) override {}
  Discard discard() const override {
    return [](void*) {};
  }
};

}  // namespace

struct Simulation::Gel {
  sensor::Sensor sensor;
  solve::SolveOptions options;
  solve::Inverse inverse;
  std::vector<track::Vector> places;
  Eigen::VectorXd press;  ///< displacements of a press of 1 N in the middle [px]
  std::vector<std::vector<float>> noises;
};

Simulation::Simulation()
    : gel_(std::make_unique<Gel>()) {
  for (sensor::MarkerLayer& layer : gel_->sensor.layers) {
    layer.columns = 8;
    layer.rows = 6;
  }
  gel_->sensor.nodes.columns = 7;
  gel_->sensor.nodes.rows = 6;
  gel_->options.model = sensor::elastic::Model::kHalfSpace;
  Disk nothing;
  disk() = &nothing;
  gel_->inverse = solve::loadOrCompute(gel_->sensor, gel_->options, "/dev/null/none").value();
  disk() = nullptr;
  gel_->places = track::nominalPlaces(gel_->sensor);
  const Eigen::MatrixXd influence = sensor::elastic::influenceMatrix(gel_->sensor, gel_->options.model);
  Eigen::VectorXd force = Eigen::VectorXd::Zero(influence.cols());
  for (const int node : {16, 17, 23, 24}) force[3 * node + 2] = 0.25;
  gel_->press = influence * force;
  Chance chance(1);
  const auto uniform = [&chance] { return (static_cast<double>(chance.next() >> 11) + 0.5) * 0x1p-53; };
  for (std::size_t k = 0; k < kNoises; ++k) {
    std::vector<float> noise(2 * gel_->places.size());
    for (float& value : noise)
      value = static_cast<float>(kNoise_px * std::sqrt(-2.0 * std::log(uniform())) * std::cos(2.0 * M_PI * uniform()));
    gel_->noises.push_back(std::move(noise));
  }
}

Simulation::~Simulation() = default;

struct Simulation::Run {
  // ------------------------------------------------------------ the tracker, which sees what pictures show

  /// The tracker's promises for a zero, see track::Tracker with awaitJudge.
  struct Tracker {
    explicit Tracker(const Gel& of)
        : gel(of) {}

    bool track(const Picture& picture, MarkerField& field) {
      if (decision) {
        if (decision->id != force.id) inForce(*decision);
        decision.reset();
      }
      using track::ZeroState;
      if (state == ZeroState::kRequested) {
        state = ZeroState::kTaking;
        begin(true);
      } else if (taking && takingRequested && state != ZeroState::kTaking) {
        taking = false;
      }
      write(picture, field);
      const bool tracked = haveRest && verdict == force.id;
      take(picture);
      return tracked;
    }

    bool cancel() {
      const bool was = state == track::ZeroState::kRequested || state == track::ZeroState::kTaking;
      if (was) state = track::ZeroState::kNone;
      return was;
    }

    bool takeRestPose(RestPose& pose) {
      if (!finished) return false;
      pose = *std::exchange(finished, std::nullopt);
      return true;
    }

    void inForce(const RestPose& pose) {
      force = pose;
      haveRest = true;
    }

    const Gel& gel;
    track::ZeroState state = track::ZeroState::kNone;
    RestPose force;
    bool haveRest = false, taking = false, takingRequested = false;
    Id verdict{};
    std::optional<RestPose> decision, finished;

   private:
    void begin(bool requested) {
      taking = true;
      takingRequested = requested;
      seen = 0;
      first = -1.0;
      sum.assign(2 * gel.places.size(), 0.0);
    }

    double placeOf(std::size_t coordinate, const Picture& picture) const {
      const track::Vector& place = gel.places[coordinate / 2];
      return (coordinate % 2 == 0 ? place.u : place.v) +
             picture.force_N * gel.press[static_cast<Eigen::Index>(coordinate)] + gel.noises[picture.noise][coordinate];
    }

    void take(const Picture& picture) {
      if (!haveRest && !taking && !picture.isFew) begin(false);
      if (!taking) return;
      if (picture.isFew || (first >= 0.0 && picture.force_N != first)) {
        taking = false;
        if (takingRequested) state = picture.isFew ? track::ZeroState::kTooFew : track::ZeroState::kMoving;
        return;
      }
      first = picture.force_N;
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += placeOf(i, picture);
      if (++seen < kZeroFrames) return;
      taking = false;
      RestPose pose;
      pose.position_px.resize(sum.size());
      for (std::size_t i = 0; i < sum.size(); ++i) pose.position_px[i] = static_cast<float>(sum[i] / seen);
      pose.amplitude.assign(gel.places.size(), 50.0F);
      pose.present.assign(gel.places.size(), 1);
      pose.oddity.assign(gel.places.size(), 0.0F);
      pose.noise = 1.0F;
      pose.taken_ns = realNow();
      pose.requested = takingRequested;
      pose.id = track::idOf(pose);
      if (takingRequested) state = track::ZeroState::kTaken;
      if (!haveRest) inForce(pose);
      finished = pose;
    }

    void write(const Picture& picture, MarkerField& field) const {
      const std::size_t count = gel.places.size();
      std::fill(field.valid.begin(), field.valid.end(), std::uint8_t{haveRest ? std::uint8_t{1} : std::uint8_t{0}});
      std::fill(field.variance_px2.begin(), field.variance_px2.end(), static_cast<float>(kNoise_px * kNoise_px));
      field.zero = force.id;
      field.flags = (field.info.discontinuity ? kDiscontinuity : 0U) | (field.info.doubted ? kDoubtedOrigin : 0U) |
                    (picture.isFew ? kFewMarkers : 0U);
      for (std::size_t i = 0; haveRest && i < 2 * count; ++i)
        field.displacement_px[i] = static_cast<float>(placeOf(i, picture) - force.position_px[i]);
      if (picture.isFew) {
        for (std::size_t i = count / 4; i < count; ++i) {
          field.valid[i] = 0;
          field.variance_px2[i] = field.displacement_px[2 * i] = field.displacement_px[2 * i + 1] = 0.0F;
        }
      }
      field.validCount = static_cast<int>(std::count(field.valid.begin(), field.valid.end(), 1));
    }

    int seen = 0;
    double first = -1.0;
    std::vector<double> sum;
  };

  // ------------------------------------------------------------ one life of the daemon, from its start to its end

  struct Truth {
    std::uint64_t number = 0;
    bool isForged = false;
  };

  struct Life : capture::FrameSource {
    explicit Life(Run& owner)
        : run(owner)
        , solver(owner.gel.inverse, owner.gel.sensor, owner.solving())
        , tracker(owner.gel)
        , truths(kNumbers)
        , intake(ledger)
        , pipeline({.source = *this,
                    .track = [this](const Frame& frame, MarkerField& markers) { return track(frame, markers); },
                    .solve =
                        [this](const MarkerField& markers, TractionField& field) {
                          solver.solve(markers, field);
                          worked = true;
                        },
                    .publish = [this](const TractionField& field) { publish(field); },
                    .waitToPublish = [](int, auto) {},
                    .control = [this](auto) { procedures.turn(); }},
                   {.markers = owner.gel.sensor.markerCount(), .nodes = owner.gel.sensor.nodes.count()}, ledger, turns)
        , procedures(owner.gel.sensor, {.zeroFrames = kZeroFrames, .directory = kState}, links()) {
      driver.is.name.vendor = "Simulated";
      driver.is.name.serial = "1";
      driver.is.shape = owner.shape;
      driver.is.frameRate_Hz = 60.0;
      driver.is.session = 1;
      intake.begin(driver.is, kBuffers);
      restore();
    }

    void restore() {
      const track::ZeroOwner whose{run.gel.sensor, PixelFormat::kRgb8, kCamera};
      auto rest = track::loadRestPose(track::restPosePath(kState), whose.sensor, whose.format, whose.camera);
      run.law(rest.has_value(), "a zero survives the loss of power", rest ? "" : rest.error().message());
      run.checkRestored(*rest);
      auto earlier = track::loadEarlierZero(kState, *rest, whose);
      run.law(earlier.has_value(), "the zero before survives the loss of power",
              earlier ? "" : earlier.error().message());
      if (*rest) tracker.inForce(**rest);
      procedures.welcome(kCamera, 60.0, *rest, earlier.value_or(std::nullopt));
    }

    ProcedureLinks links() {
      return {.frames = frames,
              .markers = newest,
              .watched = watched,
              .requestZero = [this] { tracker.state = track::ZeroState::kRequested; },
              .cancelZero = [this] { return tracker.cancel(); },
              .zeroState = [this] { return tracker.state; },
              .takeRestPose = [this](RestPose& pose) { return tracker.takeRestPose(pose); },
              .putInForce =
                  [this](const RestPose& pose, bool /*fits*/) {
                    if (run.chance.oneIn(8)) return false;  // the tracking thread is just taking one
                    tracker.decision = pose;
                    tracker.verdict = pose.id;
                    return true;
                  },
              .judge = [](const RestPose&) { return GelReport(); },
              .tellJudgement =
                  [this](const RestPose& pose, const GelReport&) {
                    tracker.verdict = pose.id == tracker.force.id ? pose.id : tracker.verdict;
                  },
              .describe = [this](const RestPose& pose) { run.heedDescribed(pose); },
              .keep = [this](const RestPose& pose, const RestPose* before) { return run.keep(pose, before); },
              .slowly = [](const auto& work) { work(); },
              .answerZero = [this](const auto& result, const std::string&) { run.heedZeroAnswer(result); },
              .answerCalibration = [this](const auto& result) { run.heedStepAnswer(result); }};
    }

    capture::Next next(Frame& frame, std::chrono::milliseconds /*timeout*/) override {
      if (run.queue.empty() || run.queue.front().at_ns > run.now()) return capture::Next::kTimeout;
      Picture& room = pictures[nextPicture++ % kPictures];
      capture::Buffer buffer;
      buffer.arrival = run.queue.front().arrival;
      room = run.queue.front().picture;
      if (!room.isForged && buffer.arrival.complete) run.hear();
      run.queue.pop_front();
      worked = true;
      buffer.arrival.host_ns = buffer.arrival.raw_ns = run.now();
      buffer.data = room.bytes.data();
      buffer.handle = &room;
      buffer.awaited = run.queue.empty();
      if (intake.judge(buffer, driver, frame).verdict != capture::Verdict::kNew) return capture::Next::kRejected;
      truths[frame.info.frameNumber % kNumbers] = {room.number, room.isForged};
      return capture::Next::kFrame;
    }

    void recycle(Frame& frame) override { frame.token = nullptr; }

    bool track(const Frame& frame, MarkerField& markers) {
      worked = true;
      const bool tracked = tracker.track(*static_cast<const Picture*>(frame.token), markers);
      frames.add();
      if (tracked) newest.put(markers);
      return tracked;
    }

    void publish(const TractionField& field) {
      worked = true;
      const auto [truth, isForged] = truths[field.markers.info.frameNumber % kNumbers];
      run.heedField(field, truth);
      run.law(truth > lastTruth || (field.flags & kDoubtedOrigin) != 0, "no stale picture without its flag",
              fmt::format("picture {} after {}", truth, lastTruth));
      // A camera that has fallen silent cannot contradict.
      run.law(!isForged || (field.flags & kDoubtedOrigin) != 0 || run.unclearUntil_ns > run.now() ||
                  run.now() - run.heard_ns > kContradicts_ns,
              "no forged picture without its flag", fmt::format("picture {}", truth));
      lastTruth = truth;
      const FrameInfo& info = field.markers.info;
      run.law(info.frameNumber > last.frameNumber && info.times.received_ns >= last.times.received_ns &&
                  info.times.captured_ns >= last.times.captured_ns,
              "numbers and times rise",
              fmt::format("frame {} captured {} after {} captured {}", info.frameNumber, info.times.captured_ns,
                          last.frameNumber, last.times.captured_ns));
      last = info;
    }

    void checkBalance(bool atEnd) const {
      constexpr std::uint64_t kMostInFlight = 22;
      const std::uint64_t gone = ledger.published.get() + ledger.losses();
      run.law(gone <= ledger.received.get() && ledger.received.get() - gone <= (atEnd ? 0 : kMostInFlight),
              "received = published + named losses",
              fmt::format("{} received, {} published, {} lost", ledger.received.get(), ledger.published.get(),
                          ledger.losses()));
    }

    Run& run;
    Ledger ledger;
    Turns turns;
    Driver driver;
    solve::Solver solver;
    Tracker tracker;
    std::array<Picture, kPictures> pictures;
    std::size_t nextPicture = 0;
    std::vector<Truth> truths;  ///< of pictures by numbers of frames
    capture::Intake intake;
    Counter frames;
    Mailbox<MarkerField> newest;
    Mailbox<Watched> watched;
    Watched lastWatched;
    Pipeline pipeline;
    Procedures procedures;
    bool worked = false;  ///< the stage that has just taken its turn had something to do
    std::uint64_t lastTruth = 0;
    FrameInfo last;
  };

  // ------------------------------------------------------------ the world

  Run(const Gel& of, const Story& told)
      : gel(of)
      , story(told)
      , chance(told.seed) {
    clocks() = {1000 * kSecond, 1'700'000'000 * kSecond};
    begin_ns = disturbedUntil_ns = now();
    nextFrame_ns = now() + kPeriod_ns;
    store.condition = [this](std::int64_t at_ns) { return diskAt(at_ns); };
    shape = {gel.sensor.camera.width, gel.sensor.camera.height, sizeof(Picture::bytes), 1};
  }

  /// The search for contacts takes most of the time: every eighth story has it.
  solve::SolveOptions solving() const {
    solve::SolveOptions options = gel.options;
    options.contactAware = story.seed % 8 == 0;
    return options;
  }

  static std::int64_t now() { return clocks().monotonic_ns; }
  std::int64_t now_ms() const { return (now() - begin_ns) / kMs; }

  void say(const std::string& line) { result.log += fmt::format("{:>9} ms  {}\n", now_ms(), line); }

  void law(bool holds, const char* name, const std::string& what) const {
    if (!holds) throw Broken{name, what, now_ms()};
  }

  bool lasts(Event event) const { return until_ns[static_cast<std::size_t>(event)] > now(); }
  std::int64_t amountOf(Event event) const { return amount[static_cast<std::size_t>(event)]; }

  // The camera.

  void takePicture() {
    nextFrame_ns += kPeriod_ns;
    id = id == 65'535 ? 1 : id + 1;  // 16 bit, never 0
    OnItsWay one;
    one.picture.number = ++pictures;
    one.picture.taken_ns = now();
    one.picture.force_N = lasts(Event::kTouch) ? 1e-3 * static_cast<double>(amountOf(Event::kTouch)) : 0.0;
    one.picture.isFew = lasts(Event::kFewMarkers);
    one.picture.noise = chance.below(kNoises);
    std::memcpy(one.picture.bytes.data(), &pictures, sizeof pictures);
    one.at_ns = now() + kUnderWay_ns + chance.between(0, kMs);
    if (lasts(Event::kLate)) one.at_ns += chance.between(0, amountOf(Event::kLate) * kMs);
    one.arrival.complete = !(lasts(Event::kBroken) && hit(Event::kBroken));
    one.arrival.shape = shape;
    one.arrival.id = id;
    one.arrival.device_ns = now() + clockAhead_ns;
    if (lasts(Event::kSilence) || (lasts(Event::kLoss) && hit(Event::kLoss))) return;
    send(one);
    if (lasts(Event::kAgain) && hit(Event::kAgain) && one.arrival.complete) {
      one.at_ns += chance.between(1, 400) * kMs;
      send(one);
    }
  }

  /// A picture of the camera's own has come.
  void hear() {
    if (now() - heard_ns > kContradicts_ns) unclearUntil_ns = std::max(unclearUntil_ns, now() + kAlarm_ns);
    heard_ns = now();
  }

  /// Another host sends as the camera.
  void forge() {
    nextForged_ns = lasts(Event::kSecondCounter) ? now() + amountOf(Event::kSecondCounter) * kMs : kNever;
    if (nextForged_ns == kNever) return;
    forgedId = forgedId >= 65'535 ? 1 : forgedId + 1;
    OnItsWay one;
    one.picture.number = ++pictures;
    one.picture.taken_ns = now();
    one.picture.isForged = true;
    one.picture.noise = chance.below(kNoises);
    std::memcpy(one.picture.bytes.data(), &pictures, sizeof pictures);
    one.at_ns = now() + chance.between(0, 2 * kMs);
    one.arrival.complete = true;
    one.arrival.shape = shape;
    one.arrival.id = forgedId;
    one.arrival.device_ns = now() + forgedAhead_ns;
    send(one);
  }

  bool hit(Event event) { return static_cast<std::int64_t>(chance.below(100)) < amountOf(event); }

  void send(const OnItsWay& one) {
    if (!life) return;
    const auto later = std::ranges::upper_bound(queue, one.at_ns, std::ranges::less(),
                                                [](const OnItsWay& each) { return each.at_ns; });
    queue.insert(later, one);
    // A starved host has no buffer free, and what comes then is lost.
    const auto here = static_cast<std::size_t>(
        std::ranges::count_if(queue, [](const OnItsWay& each) { return each.at_ns <= now(); }));
    if (here > kBuffers) queue.erase(queue.begin() + kBuffers);
  }

  // The disk.

  struct Keeping {
    std::promise<tl::expected<void, Error>> done;
    tl::expected<void, Error> outcome;
    std::int64_t at_ns = 0;
    Id zero{};
  };

  std::future<tl::expected<void, Error>> keep(const RestPose& pose, const RestPose* before) {
    overwritten = lastKept;
    lastKept = pose.id;
    isKeptHeeded = false;
    keeping.emplace_back();
    Keeping& one = keeping.back();
    one.zero = pose.id;
    store.beginWork();
    one.outcome = track::saveZeros(kState, pose, before, {gel.sensor, PixelFormat::kRgb8, kCamera});
    one.at_ns = store.endWork();
    say(fmt::format("zero {} is being written, for {} ms{}", nameOf(pose.id), (one.at_ns - now()) / kMs,
                    one.outcome ? "" : ", and cannot be"));
    return one.done.get_future();
  }

  void finishKeeping() {
    for (; !keeping.empty() && keeping.front().at_ns <= now(); keeping.pop_front()) {
      if (keeping.front().outcome) wasKept = true;
      keeping.front().done.set_value(keeping.front().outcome);
    }
  }

  Disk::Condition diskAt(std::int64_t at_ns) const {
    Disk::Condition is;
    for (const Happening& one : story.happenings) {
      const std::int64_t from_ns = begin_ns + one.at_ms * kMs;
      if (from_ns > at_ns) break;
      if (from_ns + one.for_ms * kMs <= at_ns) continue;
      if (one.event == Event::kSlowDisk) is.sync_ns = one.amount * kMs;
      is.isFull = is.isFull || one.event == Event::kFullDisk;
      is.failsToSync = is.failsToSync || one.event == Event::kFailingDisk;
    }
    return is;
  }

  // What the laws remember.

  void heedDescribed(const RestPose& pose) {
    const bool isFirst = !inForce, isOther = inForce && *inForce != pose.id;
    if (isOther) {
      Disk* const real = std::exchange(disk(), nullptr);
      Disk left;
      const auto content = store.synchronised(track::restPosePath(kState));
      if (content) left.put(track::restPosePath(kState), *content);
      disk() = &left;
      const auto kept = track::loadRestPose(track::restPosePath(kState), gel.sensor, PixelFormat::kRgb8, kCamera);
      disk() = real;
      law(kept && *kept && (*kept)->id == pose.id, "a zero in force is on the disk",
          fmt::format("zero {} is in force", nameOf(pose.id)));
      law(pose.requested || hasUndone, "no zero comes into force that nobody asked for", nameOf(pose.id));
    }
    if (isOther) previous = inForce;
    if (isFirst || isOther) describedAt_ns = now();
    if (isFirst || isOther) say(fmt::format("zero {} is in force", nameOf(pose.id)));
    inForce = pose.id;
  }

  void checkRestored(const std::optional<RestPose>& rest) {
    if (!hasLived) return;
    const std::string is = rest ? nameOf(rest->id) : "none";
    say("restored zero: " + is);
    const bool isWriting = !isKeptHeeded;
    bool fits = false;
    if (!rest) {
      fits = !wasKept;
    } else {
      fits = (inForce && rest->id == *inForce) || (isWriting && (rest->id == lastKept || rest->id == overwritten));
    }
    law(fits, "after a loss of power the state is that of before or after",
        fmt::format("zero {} is restored, {} was in force", is, inForce ? nameOf(*inForce) : "none"));
    // Another one than that in force: which it is the one before of is not followed here.
    if (!rest || !inForce || rest->id != *inForce) previous.reset();
    inForce.reset();
    isKeptHeeded = true;
    if (rest) lastKept = overwritten = rest->id;
  }

  void heedField(const TractionField& field, std::uint64_t truth) {
    ++result.published;
    lastField_ns = now();
    const std::int64_t age_ns = now() - field.markers.info.times.received_ns;
    constexpr std::int64_t kOldest_ns = 400 * kMs;
    law(age_ns <= kOldest_ns + starved_ns - starvedUntil(field.markers.info.times.received_ns),
        "no field older than its bound", fmt::format("{} ms", age_ns / kMs));
    bool isFinite = true, isNothing = field.noise[0] == 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      isFinite = isFinite && std::isfinite(field.resultant_N[i]) && std::isfinite(field.noise[7 * i]);
      isNothing = isNothing && field.resultant_N[i] == 0.0 && field.moment_Nm[i] == 0.0;
    }
    const bool hasCovariance = field.noise[0] > 0.0 && field.noise[7] > 0.0 && field.noise[14] > 0.0;
    law(isFinite && (field.valid ? hasCovariance : isNothing), "validity and covariance agree",
        fmt::format("valid {}, variance {}", field.valid, field.noise[14]));
    law(now() - describedAt_ns < kSecond + starved_ns - starvedUntil(describedAt_ns) ||
            (inForce && field.markers.zero == *inForce),
        "fields rest on the zero that is described",
        fmt::format("{}, not {}", nameOf(field.markers.zero), inForce ? nameOf(*inForce) : "none"));
    law(!field.valid || (field.flags & kFewMarkers) == 0, "few markers make a field not valid", "");
    if (field.valid) ++result.valid;
    const auto add = [this](const void* bytes, std::size_t size) {
      result.fields = XXH3_64bits_withSeed(bytes, size, result.fields);
    };
    add(field.force_N.data(), field.force_N.size() * sizeof field.force_N[0]);
    add(field.resultant_N.data(), sizeof field.resultant_N);
    add(field.noise.data(), sizeof field.noise);
    add(&truth, sizeof truth);
  }

  /// Of the time that stages were starved, what was over at a moment.
  std::int64_t starvedUntil(std::int64_t at_ns) const {
    std::int64_t before = 0;
    for (const auto& [end_ns, length_ns] : starvations) before += end_ns <= at_ns ? length_ns : 0;
    return before;
  }

  // People.

  void askZero(bool undo, bool anyway) {
    if (!life) return;
    ++result.zerosAsked;
    if (zeroAskers > 0) {
      if (undo || anyway != zeroAnyway) return;  // refused at once
      ++zeroAskers;
      return;
    }
    zeroAskers = 1;
    zeroAnyway = anyway;
    isUndo = hasUndone = undo;
    askedWith = inForce;
    expected = previous;
    zeroAnswers = 0;
    life->watched.take(life->lastWatched);
    const double within_s = life->lastWatched.zeroWithin_s;
    zeroUntil_ns = within_s > 0.0 ? now() + static_cast<std::int64_t>(1e9 * within_s) + 500 * kMs : kNever;
    zeroAskedStarved_ns = starved_ns;
    say(undo ? "asked: undo" : anyway ? "asked: zero, anyway" : "asked: zero");
    life->procedures.beginZero({.anyway = anyway, .undo = undo, .asker = "somebody"});
  }

  void heedZeroAnswer(const tl::expected<RestPose, std::string>& answer) {
    say("answer: " + (answer ? "zero " + nameOf(answer->id) : answer.error()));
    law(zeroAskers > 0, "each request gets one answer", "an answer to nobody");
    if (answer) {
      law(inForce && *inForce == answer->id, "the zero that is answered is in force", nameOf(answer->id));
      if (isUndo) {
        law(!askedWith || *askedWith != answer->id, "an undo restores another zero", nameOf(answer->id));
        law(!expected || *expected == answer->id, "an undo restores the zero before",
            fmt::format("{}, not {}", nameOf(answer->id), expected ? nameOf(*expected) : ""));
        ++result.undone;
      } else {
        ++result.zerosTaken;
      }
    }
    zeroAskers = 0;
  }

  void askStep(std::int64_t length_ms) {
    if (!life) return;
    CalibrationStep step;
    step.kind = CalibrationStep::Kind::kNoise;
    step.seconds = 1e-3 * static_cast<double>(length_ms);
    stepAsked = true;  // who asked before is answered by the control server
    constexpr std::int64_t kSlack_ns = 11 * kSecond;
    stepUntil_ns =
        now() + length_ms * kMs + static_cast<std::int64_t>(1e9 * calibrate::CalibrationOptions{}.grace_s) + kSlack_ns;
    stepAskedStarved_ns = starved_ns;
    say(fmt::format("asked: noise over {} ms", length_ms));
    life->procedures.beginStep(step);
  }

  void heedStepAnswer(const calibrate::Result& answer) {
    say("answer: " + (answer ? std::string("the step is done") : answer.error()));
    law(std::exchange(stepAsked, false), "each request gets one answer", "an answer to a step that nobody asked for");
  }

  void checkAnswers() const {
    law(zeroAskers == 0 || zeroUntil_ns == kNever || now() <= zeroUntil_ns + starved_ns - zeroAskedStarved_ns,
        "each request is answered in its time", "a zero or undo");
    law(!stepAsked || now() <= stepUntil_ns + starved_ns - stepAskedStarved_ns, "each request is answered in its time",
        "a step of a calibration");
  }

  void checkFlow() {
    constexpr std::int64_t kCalm_ns = 6 * kSecond, kFlows_ns = kSecond;
    if (now() - disturbedUntil_ns < kCalm_ns) return;
    law(now() - lastField_ns <= kFlows_ns, "after faults end fields flow",
        fmt::format("the last field came {} ms ago, the last fault ended {} ms ago", (now() - lastField_ns) / kMs,
                    (now() - disturbedUntil_ns) / kMs));
  }

  // Lives.

  void start() {
    if (startAt_ns > now()) return;
    startAt_ns = kNever;
    life = std::make_unique<Life>(*this);
    hasLived = true;
    busyUntil_ns.fill(now());
    ready.fill(false);
    controlAt_ns = now();
    unclearUntil_ns = std::max(unclearUntil_ns, now() + kAlarm_ns);
    say("the daemon runs");
  }

  void die(bool powerIsCut) {
    if (!life) return;
    say(powerIsCut ? "the power is lost" : "the daemon is killed");
    ++result.restarts;
    result.received += life->ledger.received.get();
    life->checkBalance(false);
    life.reset();
    keeping.clear();
    queue.clear();
    if (powerIsCut)
      store.losePower(now(), chance);
    else
      store.kill(now());
    zeroAskers = 0;
    stepAsked = false;
    startAt_ns = now() + 2 * kSecond;
    disturb(startAt_ns);
  }

  void disturb(std::int64_t until) { disturbedUntil_ns = std::max(disturbedUntil_ns, until); }

  void happen(const Happening& one) {
    const auto index = static_cast<std::size_t>(one.event);
    amount[index] = one.amount;
    until_ns[index] = now() + one.for_ms * kMs;
    switch (one.event) {
    case Event::kLoss:
    case Event::kBroken:
    case Event::kSilence:
    case Event::kAgain:
    case Event::kLate:
    case Event::kFewMarkers:
      disturb(until_ns[index]);
      break;
    case Event::kSecondCounter:
      if (nextForged_ns == kNever) nextForged_ns = now();
      forgedId = (id + static_cast<std::uint64_t>(chance.between(2000, 60'000))) % 65'535 + 1;
      forgedAhead_ns = chance.between(-1000, 1000) * kSecond;
      unclearUntil_ns = std::max(unclearUntil_ns, now() + kAlarm_ns);
      disturb(until_ns[index]);
      break;
    case Event::kIdsRestart:
      id = 0;
      disturb(now());
      break;
    case Event::kIdsJump:
      id = (id + static_cast<std::uint64_t>(one.amount)) % 65'535;
      disturb(now());
      break;
    case Event::kClockStep:
      clockAhead_ns += one.amount * kMs;
      disturb(now());
      break;
    case Event::kTimeSet:
      clocks().realAhead_ns += one.amount * kSecond;
      break;
    case Event::kStarved: {
      std::int64_t& busy = busyUntil_ns[static_cast<std::size_t>(one.amount)];
      busy = std::max(busy, until_ns[index]);
      if (one.amount == 4) controlAt_ns = std::max(controlAt_ns, busy);
      starved_ns += one.for_ms * kMs;
      starvations.emplace_back(busy, one.for_ms * kMs);
      disturb(busy);
      break;
    }
    case Event::kKill:
      die(false);
      break;
    case Event::kPowerCut:
      die(true);
      break;
    case Event::kZero:
      askZero(false, false);
      break;
    case Event::kZeroAnyway:
      askZero(false, true);
      break;
    case Event::kUndo:
      askZero(true, false);
      break;
    case Event::kNoise:
      askStep(one.amount);
      break;
    case Event::kSlowDisk:
    case Event::kFullDisk:
    case Event::kFailingDisk:
    case Event::kTouch:
      break;
    }
  }

  // Time.

  static constexpr std::array kStages = {Stage::kCapture, Stage::kTrack, Stage::kSolve, Stage::kPublish};

  /// The stages that are ready take turns until none is.
  void work() {
    for (;;) {
      std::array<std::size_t, kStages.size()> able{};
      std::size_t count = 0;
      ready[0] = !queue.empty() && queue.front().at_ns <= now();
      for (std::size_t i = 0; i < kStages.size(); ++i) {
        if (ready[i] && busyUntil_ns[i] <= now()) able[count++] = i;
      }
      if (count == 0) break;
      const std::size_t i = able[count == 1 ? 0 : chance.below(count)];
      life->worked = false;
      life->pipeline.turn(kStages[i], std::chrono::milliseconds(0));
      if (!life->worked) {
        ready[i] = false;
        continue;
      }
      constexpr std::array<std::int64_t, 4> kLongest_us = {100, 6000, 4000, 300};
      busyUntil_ns[i] = now() + 1000 * chance.between(kLongest_us[i] / 4, kLongest_us[i]);
      if (i + 1 < kStages.size()) ready[i + 1] = true;
    }
    if (controlAt_ns > now()) return;
    const std::int64_t waited_ns = store.waitedFor();
    life->pipeline.turn(Stage::kControl, std::chrono::milliseconds(0));
    law(store.waitedFor() == waited_ns, "the control thread waits for no disk",
        fmt::format("{} ms", (store.waitedFor() - waited_ns) / kMs));
    if (keeping.empty()) isKeptHeeded = true;
    const bool hurried = life->procedures.hurried();
    controlAt_ns = now() + (hurried ? 3 : chance.between(20, 100)) * kMs;
    checkAnswers();
    checkFlow();
    life->checkBalance(false);
  }

  std::int64_t nextMoment(std::size_t nextHappening) const {
    std::int64_t next = std::min({nextFrame_ns, nextForged_ns, begin_ns + story.lasts_ms * kMs});
    if (nextHappening < story.happenings.size())
      next = std::min(next, begin_ns + story.happenings[nextHappening].at_ms * kMs);
    if (!keeping.empty()) next = std::min(next, keeping.front().at_ns);
    if (!life) return std::min(next, startAt_ns);
    next = std::min(next, controlAt_ns);
    if (!queue.empty()) next = std::min(next, std::max(queue.front().at_ns, busyUntil_ns[0]));
    for (std::size_t i = 1; i < kStages.size(); ++i) {
      if (ready[i]) next = std::min(next, busyUntil_ns[i]);
    }
    return next;
  }

  void stop() {
    if (!life) return;
    life->pipeline.requestStop();
    for (const Stage stage : kStages) {
      while (life->pipeline.turn(stage, std::chrono::milliseconds(0))) {
      }
    }
    life->pipeline.settle();
    life->checkBalance(true);
    result.received += life->ledger.received.get();
  }

  void go(const std::function<bool()>& goesOn) {
    start();
    std::int64_t asked_ns = now();
    for (std::size_t next = 0; now() < begin_ns + story.lasts_ms * kMs;) {
      clocks().monotonic_ns = std::max(now(), nextMoment(next));
      while (next < story.happenings.size() && begin_ns + story.happenings[next].at_ms * kMs <= now())
        happen(story.happenings[next++]);
      if (nextFrame_ns <= now()) takePicture();
      if (nextForged_ns <= now()) forge();
      finishKeeping();
      if (!life) start();
      if (life) work();
      if (goesOn && now() - asked_ns >= kSecond) {
        asked_ns = now();
        if (!goesOn()) return;
      }
    }
    stop();
  }

  const Gel& gel;
  const Story& story;
  Chance chance;
  Disk store;
  Result result;
  std::int64_t begin_ns = 0;
  std::array<std::int64_t, 32> until_ns{}, amount{};

  capture::PictureShape shape;
  std::int64_t nextFrame_ns = 0, clockAhead_ns = -500 * kSecond;
  std::uint64_t id = 0, pictures = 0;
  std::deque<OnItsWay> queue;
  std::int64_t nextForged_ns = kNever, forgedAhead_ns = 0;
  std::uint64_t forgedId = 0;
  std::int64_t heard_ns = 0;         ///< when the camera's last own picture came
  std::int64_t unclearUntil_ns = 0;  ///< until then the gate need not know which pictures are the camera's own

  std::deque<Keeping> keeping;
  std::unique_ptr<Life> life;
  bool hasLived = false;
  std::int64_t startAt_ns = 0, controlAt_ns = 0, disturbedUntil_ns = 0, lastField_ns = 0;
  std::array<std::int64_t, 5> busyUntil_ns{};
  std::array<bool, 4> ready{};
  std::int64_t starved_ns = 0;
  std::vector<std::pair<std::int64_t, std::int64_t>> starvations;  ///< end, length

  std::optional<Id> inForce, askedWith, previous, expected;
  std::int64_t describedAt_ns = 0;
  Id lastKept{}, overwritten{};
  bool isKeptHeeded = true;  ///< the procedures know what became of the last zero that was written
  bool wasKept = false, hasUndone = false;
  int zeroAskers = 0, zeroAnswers = 0;
  bool zeroAnyway = false, isUndo = false, stepAsked = false;
  std::int64_t zeroUntil_ns = kNever, stepUntil_ns = 0, zeroAskedStarved_ns = 0, stepAskedStarved_ns = 0;
};

namespace {

/// What the daemon logs is a part of what happens.
class Log : public spdlog::sinks::base_sink<spdlog::details::null_mutex> {
 public:
  explicit Log(std::function<void(const std::string&)> say)
      : say_(std::move(say)) {}

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    say_("log: " + std::string(message.payload.begin(), message.payload.end()));
  }
  void flush_() override {}

 private:
  std::function<void(const std::string&)> say_;
};

}  // namespace

Result Simulation::run(const Story& story, const std::function<bool()>& goesOn) {
  Run run(*gel_, story);
  disk() = &run.store;
  const auto before = spdlog::default_logger();
  spdlog::set_default_logger(std::make_shared<spdlog::logger>(
      "simulation", std::make_shared<Log>([&run](const std::string& line) { run.say(line); })));
  try {
    run.go(goesOn);
  } catch (const Broken& broken) {
    run.result.broken = broken;
    run.say("BROKEN: " + broken.law + ": " + broken.what);
  }
  run.life.reset();
  spdlog::set_default_logger(before);
  disk() = nullptr;
  run.result.reached_ms = run.now_ms();
  return run.result;
}

Story Simulation::shrink(const Story& story, const std::string& law) {
  const auto breaks = [&](const Story& one) {
    const Result result = run(one);
    return result.broken && result.broken->law == law ? std::optional(result.broken->at_ms) : std::nullopt;
  };
  Story least = story;
  const auto heedEnd = [&least](std::int64_t at_ms) {
    least.lasts_ms = std::min(least.lasts_ms, at_ms + 1000);
    std::erase_if(least.happenings, [&](const Happening& one) { return one.at_ms > at_ms; });
  };
  if (const auto at_ms = breaks(least)) heedEnd(*at_ms);
  // Halves first, then ever smaller parts, until no single happening can be left out.
  for (std::size_t part = std::max<std::size_t>(least.happenings.size() / 2, 1);;) {
    bool hasShrunk = false;
    for (std::size_t i = 0; i < least.happenings.size();) {
      Story shorter = least;
      const auto first = shorter.happenings.begin() + static_cast<std::ptrdiff_t>(i);
      shorter.happenings.erase(first, first + static_cast<std::ptrdiff_t>(std::min(part, least.happenings.size() - i)));
      if (const auto at_ms = breaks(shorter)) {
        least = shorter;
        heedEnd(*at_ms);
        hasShrunk = true;
      } else {
        i += part;
      }
    }
    if (part > 1)
      part /= 2;
    else if (!hasShrunk)
      break;
  }
  return least;
}

}  // namespace tractiond::simulation

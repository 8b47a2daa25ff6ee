// Between the camera's pop and ZeroMQ's send our code allocates nothing, frees nothing and takes no lock (so it cannot
// log either): real stages on their threads, with a subscriber, every call of malloc and pthread_mutex_lock counted.
#include "daemon/app/pipeline.h"
#include "daemon/app/previewer.h"
#include "daemon/capture/camera.h"
#include "daemon/publish/publisher.h"
#include "daemon/solve/model_solver.h"
#include "daemon/track/tracker.h"
#include "tests/support/memory_driver.h"
#include "tests/unit/app/interposed.h"
#include "twin/renderer.h"

#include <gtest/gtest.h>
#include <zmq.hpp>

namespace tractiond::hot_path_test {
namespace {

using namespace std::chrono_literals;

/// A coarse gel, so that its factors take no time; the stages do per marker what they always do.
sensor::Sensor coarseSensor() {
  sensor::Sensor sensor;
  for (sensor::MarkerLayer& layer : sensor.layers) {
    layer.columns = layer.rows = 8;
    layer.pitch = 6e-3;
  }
  sensor.nodes.columns = sensor.nodes.rows = 6;
  sensor.nodes.pitch = 8e-3;
  return sensor;
}

/// A still gel, with noise; every tenth picture lacks some of its markers.
test::Pictures draw(const sensor::Sensor& sensor) {
  twin::Renderer renderer(sensor, {}, twin::Format::kRgb8);
  const sensor::Projection project(sensor.camera, sensor.gel.size.z());
  const sensor::Points points = sensor::markerPositions(sensor.layers);
  Eigen::Matrix2Xd markers(2, points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) markers.col(i) = project(points.col(i));
  test::Pictures pictures{sensor.camera.width, sensor.camera.height, PixelFormat::kRgb8, {}};
  for (std::uint32_t seed = 1; seed <= 50; ++seed) {
    Eigen::Matrix2Xd drawn = markers;
    if (seed > 40 && seed % 10 == 0) drawn.leftCols(5).setConstant(std::nan(""));
    renderer.render(drawn, seed, pictures.data.emplace_back(renderer.pictureSize()));
  }
  return pictures;
}

/// Marks the thread that calls it for the first time.
struct Marking {
  void operator()() {
    if (!std::exchange(done, true)) interposed::markThisThread();
  }
  bool done = false;
};

class MarkedSource : public capture::FrameSource {
 public:
  explicit MarkedSource(capture::FrameSource& inner)
      : inner_(inner) {}
  capture::Next next(Frame& frame, std::chrono::milliseconds timeout) override {
    mark_();
    return inner_.next(frame, timeout);
  }
  void recycle(Frame& frame) override { inner_.recycle(frame); }

 private:
  capture::FrameSource& inner_;
  Marking mark_;
};

class Work final : public Stages {
 public:
  Work(track::Tracker& tracker, solve::FieldSolver& solver, publish::Publisher& publisher, Previewer& previewer)
      : tracker_(tracker)
      , solver_(solver)
      , publisher_(publisher)
      , previewer_(previewer) {}
  bool track(const Frame& frame, MarkerField& markers) override {
    mark_[0]();
    const bool tracked = tracker_.track(frame, markers) == track::Outcome::kTracked;
    previewer_.takeFrame(frame, tracked ? &markers : nullptr);
    return tracked;
  }
  void solve(const MarkerField& markers, TractionField& field) override {
    mark_[1]();
    solver_.solve(markers, field);
  }
  void publish(const TractionField& field) override {
    mark_[2]();
    publisher_.publish(field);
  }
  void serveSubscribers(int fd, std::chrono::milliseconds timeout) override { publisher_.serve(fd, timeout); }
  void preview(std::chrono::milliseconds timeout) override { previewer_.turn(timeout); }

 private:
  track::Tracker& tracker_;
  solve::FieldSolver& solver_;
  publish::Publisher& publisher_;
  Previewer& previewer_;
  std::array<Marking, 3> mark_;
};

void runCounted(WhenFull whenFull) {
  const sensor::Sensor sensor = coarseSensor();
  const test::Pictures pictures = draw(sensor);
  const solve::Atoms atoms = solve::makeAtoms(sensor);
  solve::SolveOptions solving;
  solving.model = sensor::elastic::Model::kHalfSpace;
  const auto factors = solve::computeFactors(sensor, atoms, solving);
  ASSERT_TRUE(factors) << factors.error().message();
  Ledger ledger;
  track::Tracker tracker(sensor, {});
  solve::ModelSolver solver(*factors, atoms, sensor, solving);
  publish::Description description;
  description.identity.sensor = "gel";
  publish::describe(sensor, description.message);
  publish::PublishOptions publishOptions;
  publishOptions.stream = publishOptions.latest = {"tcp://127.0.0.1:*"};
  publishOptions.statusInterval = 20ms;      // so that some fall into the counted time
  publishOptions.descriptionInterval = 0ms;  // so that the subscriber's has been sent before
  auto publisher = publish::Publisher::open(publishOptions, description, ledger, [](auto&) {});
  ASSERT_TRUE(publisher) << publisher.error().message();

  Previewer previewer(**publisher, {.rate_Hz = 60.0});
  zmq::context_t context;
  zmq::socket_t subscriber(context, zmq::socket_type::sub);
  subscriber.set(zmq::sockopt::subscribe, "");
  subscriber.set(zmq::sockopt::subscribe, "traction/v1/gel/preview/");
  subscriber.connect((*publisher)->streamEndpoints()[0]);

  auto memory = capture::Camera::open(test::fromMemory(pictures, 0), {}, ledger);
  ASSERT_TRUE(memory);
  MarkedSource source(**memory);
  Work work(tracker, solver, **publisher, previewer);
  Turns turns;
  Pipeline pipeline(
      source, work,
      {.markers = sensor.markerCount(), .nodes = sensor.nodes.count(), .whenFull = whenFull, .previews = true}, ledger,
      turns);
  pipeline.start();
  // All topics, because each message's memory is made when it is filled for the first time.
  const auto receive = [&](int fields, int statuses, int previews) {
    zmq::message_t topic, rest;
    while (fields > 0 || statuses > 0 || previews > 0) {
      ASSERT_TRUE(subscriber.recv(topic));
      for (zmq::message_t* last = &topic; last->more(); last = &rest) ASSERT_TRUE(subscriber.recv(rest));
      if (topic.to_string_view() == "traction/v1/gel/field/") --fields;
      if (topic.to_string_view() == "traction/v1/gel/status/") --statuses;
      if (topic.to_string_view() == "traction/v1/gel/preview/") --previews;
    }
  };
  const auto ours = interposed::ours();
  const auto libraries = interposed::ofLibraries();
  receive(1, 0, 0);
  receive(100, 3, 3);
  interposed::count(true);
  receive(500, 3, 3);
  interposed::count(false);
  pipeline.stop();

  EXPECT_TRUE(balanced(ledger));
  EXPECT_EQ(interposed::ours().allocations, ours.allocations);
  EXPECT_EQ(interposed::ours().frees, ours.frees);
  EXPECT_EQ(interposed::ours().locks, ours.locks);
  EXPECT_GT(interposed::ofLibraries().allocations, libraries.allocations)
      << "the counting works, and reaches into libraries";
}

TEST(HotPath, AllocatesAndLocksNothingWhenLinksEvict) {
  runCounted(WhenFull::kEvictOldest);
}
TEST(HotPath, AllocatesAndLocksNothingWhenLinksWait) {
  runCounted(WhenFull::kWait);
}

}  // namespace
}  // namespace tractiond::hot_path_test

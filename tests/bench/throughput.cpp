// The highest rate of the whole chain: 256 distinct pictures in memory, a source that waits instead of dropping, and
// one subscriber in another process that must lose nothing. Prints JSON.
// usage: throughput STATE_DIRECTORY
#include "client/include/traction/subscriber.h"
#include "daemon/app/pipeline.h"
#include "daemon/capture/camera.h"
#include "daemon/publish/publisher.h"
#include "daemon/solve/make_solver.h"
#include "daemon/track/tracker.h"
#include "sensor/elastic/half_space.h"
#include "tests/support/memory_driver.h"
#include "twin/renderer.h"

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <numbers>

using namespace tractiond;

namespace {

constexpr int kPictures = 256;
constexpr std::uint64_t kLoops = 40;

/// A press that comes and goes. The tracker sees markers move; that the force is right is for other programs to show.
test::Pictures pictures(const sensor::Sensor& sensor) {
  twin::Renderer renderer(sensor, {}, twin::Format::kRgb8);
  const sensor::Projection project(sensor.camera, sensor.gel.size.z());
  const sensor::Points markers = sensor::markerPositions(sensor.layers);
  test::Pictures result{.width = sensor.camera.width, .height = sensor.camera.height, .data = {}};
  result.data.resize(kPictures, std::vector<std::uint8_t>(renderer.pictureSize()));
  Eigen::Matrix2Xd markers_px(2, markers.cols());
  for (int i = 0; i < kPictures; ++i) {
    const double force_N = 2.0 * (1.0 - std::cos(2.0 * std::numbers::pi * std::max(0, i - 64) / (kPictures - 64)));
    for (Eigen::Index m = 0; m < markers.cols(); ++m) {
      const Eigen::Vector3d point = markers.col(m);
      markers_px.col(m) = project(
          point +
          force_N *
              sensor::elastic::halfSpaceDisplacement(point, sensor.gel.youngsModulus, sensor.gel.poissonRatio).col(2));
    }
    renderer.render(markers_px, static_cast<std::uint32_t>(i), result.data[static_cast<std::size_t>(i)]);
  }
  return result;
}

/// Receives until nothing has come for a second. Prints what came.
int subscribe(const std::string& endpoint) {
  traction::Subscriber subscriber({.endpoint = endpoint, .topics = traction::kField, .queue = 100'000});
  std::vector<double> latencies_ms;
  std::uint64_t first = 0, last = 0;
  std::int64_t first_ns = 0, last_ns = 0;
  for (;;) {
    const auto message = subscriber.receive(std::chrono::milliseconds(latencies_ms.empty() ? 30'000 : 1000));
    if (!message) break;
    const auto& header = std::get<traction::Field>(*message).header;
    if (latencies_ms.empty()) {
      first = header.sequence;
      first_ns = header.arrived_ns;
    }
    last = header.sequence;
    last_ns = header.arrived_ns;
    latencies_ms.push_back(static_cast<double>(header.arrived_ns - header.received_ns) * 1e-6);
  }
  if (latencies_ms.size() < 2) return 1;
  std::sort(latencies_ms.begin(), latencies_ms.end());
  std::printf(R"({"frames":%zu,"lost":%llu,"rate_hz":%.1f,"p50_ms":%.3f,"p99_ms":%.3f})"
              "\n",
              latencies_ms.size(), static_cast<unsigned long long>(last - first + 1 - latencies_ms.size()),
              static_cast<double>(last - first) / (static_cast<double>(last_ns - first_ns) * 1e-9),
              latencies_ms[latencies_ms.size() / 2], latencies_ms[latencies_ms.size() * 99 / 100]);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 64;
  const std::filesystem::path state = argv[1];
  const std::string endpoint = "ipc://" + (state / ("throughput-" + std::to_string(getpid()))).string();
  const pid_t child = fork();
  if (child == 0) {
    const int result = subscribe(endpoint);
    std::fflush(stdout);
    _exit(result);
  }

  const sensor::Sensor sensor;
  const test::Pictures movie = pictures(sensor);
  const auto made = solve::makeSolver(sensor, {}, state);
  if (!made) return std::cerr << made.error().message() << "\n", 1;
  Ledger ledger;
  Turns turns;
  track::Tracker tracker(sensor, {});
  // The queue absorbs the moments in which the subscriber is not running.
  publish::PublishOptions options{.stream = {endpoint}, .latest = {}, .highWaterMark = 100'000};
  publish::Description description;
  description.identity.sensor = "bench";
  auto publisher = publish::Publisher::open(options, description, ledger, [](auto&) {});
  if (!publisher) return std::cerr << publisher.error().message() << "\n", 1;
  for (int i = 0; i < 10; ++i) (*publisher)->serve(-1, std::chrono::milliseconds(100));  // the subscriber joins

  auto source = capture::Camera::open(test::fromMemory(movie, kLoops), {}, ledger);
  if (!source) return std::cerr << source.error().message() << "\n", 1;
  struct Work final : Stages {
    Work(track::Tracker& tracks, solve::FieldSolver& solves, publish::Publisher& publishes)
        : tracker(tracks)
        , solver(solves)
        , publisher(publishes) {}
    bool track(const Frame& frame, MarkerField& markers) override {
      return tracker.track(frame, markers) == track::Outcome::kTracked;
    }
    void solve(const MarkerField& markers, TractionField& field) override { solver.solve(markers, field); }
    void publish(const TractionField& field) override { publisher.publish(field); }
    void serveSubscribers(int fd, std::chrono::milliseconds timeout) override { publisher.serve(fd, timeout); }
    track::Tracker& tracker;
    solve::FieldSolver& solver;
    publish::Publisher& publisher;
  } work(tracker, *made->solver, **publisher);
  Pipeline pipeline(
      **source, work,
      PipelineOptions{.markers = sensor.markerCount(), .nodes = sensor.nodes.count(), .whenFull = WhenFull::kWait},
      ledger, turns);
  pipeline.start();
  pipeline.finish();
  int status = 0;
  for (int i = 0; i < 20; ++i) (*publisher)->serve(-1, std::chrono::milliseconds(100));  // what is queued goes out
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

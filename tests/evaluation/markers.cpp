// Gels that somebody made: dots, light and dirt drawn at random, and what the tracker makes of them.
#include "daemon/track/nominal.h"
#include "tests/unit/track/information.h"

#include <CLI/CLI.hpp>

#include <functional>
#include <iostream>
#include <string>
#include <utility>

namespace {

using namespace tractiond;
using namespace tractiond::track;

/// One gel and its camera.
struct Gel {
  sensor::Sensor sensor;
  twin::Optics optics;
  double missing = 0.0;   ///< share of the markers
  double touching = 0.0;  ///< share of the markers that are moved until they touch a neighbour
};

class Draw {
 public:
  explicit Draw(std::uint64_t seed)
      : generator_(seed) {}
  double operator()(double from, double to) { return std::uniform_real_distribution<double>(from, to)(generator_); }
  bool coin(double share = 0.5) { return std::bernoulli_distribution(share)(generator_); }
  unsigned seed() { return static_cast<unsigned>(generator_()); }

 private:
  std::mt19937_64 generator_;
};

/// One layer of the paper's lattice, of any dots and a little noise.
Gel plainGel(Draw& draw) {
  Gel gel;
  gel.sensor.layers.resize(1);
  sensor::MarkerLayer& layer = gel.sensor.layers[0];
  layer.colour = sensor::Colour::kGrey;
  layer.darker = draw.coin();
  const double paper_px = 2.0 * markerRadius(gel.sensor, layer);
  layer.diameter *= draw(4.0, 10.0) / paper_px;
  gel.optics.background = layer.darker ? 150.0 : 20.0;
  gel.optics.contrast = draw(40.0, 100.0);
  gel.optics.blur_px = draw(0.5, 1.3);
  gel.optics.readNoise = draw(1.0, 3.0);
  gel.optics.variety.seed = draw.seed();
  return gel;
}

/// What a family adds, at most so much of it.
using Change = std::function<void(Gel&, Draw&, double most)>;

const std::vector<std::pair<std::string, Change>>& families() {
  static const std::vector<std::pair<std::string, Change>> all = {
      {"sizes", [](Gel& gel, Draw& draw, double most) { gel.optics.variety.diameter = most * draw(0.02, 0.2); }},
      {"contrasts", [](Gel& gel, Draw& draw, double most) { gel.optics.variety.contrast = most * draw(0.02, 0.2); }},
      {"ellipses", [](Gel& gel, Draw& draw, double most) { gel.optics.variety.elongation = most * draw(0.05, 0.3); }},
      {"light",
       [](Gel& gel, Draw& draw, double most) {
         gel.optics.lightSlope = most * Eigen::Vector2d(draw(-0.3, 0.3), draw(-0.3, 0.3));
         gel.optics.lightFalloff = most * draw(0.0, 0.5);
       }},
      {"dust",
       [](Gel& gel, Draw& draw, double most) {
         const double specks = most * draw(20.0, 300.0);
         for (int i = 0; i < specks; ++i) {
           gel.optics.dust.push_back({{draw(0.0, 640.0), draw(0.0, 480.0)}, draw(0.4, 3.0)});
         }
       }},
      {"glare",
       [](Gel& gel, Draw& draw, double most) {
         for (int i = 0; i < 3; ++i) {
           gel.optics.highlights.push_back(
               {{draw(0.0, 640.0), draw(0.0, 480.0)}, draw(8.0, 30.0), most * draw(50.0, 300.0)});
         }
       }},
      {"missing", [](Gel& gel, Draw& draw, double most) { gel.missing = most * draw(0.01, 0.1); }},
      {"touching", [](Gel& gel, Draw& draw, double most) { gel.touching = most * draw(0.01, 0.1); }},
  };
  return all;
}

/// Moves dots to the right until they touch the next of their row.
void touch(Scene& scene, Draw& draw, double share) {
  const int columns = scene.sensor.layers[0].columns;
  const double diameter_px = 2.0 * markerRadius(scene.sensor, scene.sensor.layers[0]);
  for (Eigen::Index i = 0; i < scene.rest.cols(); ++i) {
    if (i % columns == columns - 1 || !draw.coin(share)) continue;
    const Eigen::Vector2d next = scene.rest.col(i + 1);
    if (next.allFinite()) scene.rest.col(i) = next - Eigen::Vector2d(diameter_px, 0.0);
  }
  scene.now = scene.rest;
}

/// Prints: markers, found, valid under load, wrong, rms error over the bound, squared error over variance, diameter.
void run(const std::string& name, const Gel& gel, Draw& draw) {
  Scene scene(gel.optics, twin::Format::kMono8, gel.sensor);
  scene.remove(gel.missing, draw.seed());
  touch(scene, draw, gel.touching);
  Tracking tracking(scene);
  tracking.tracker.requestZero();
  RestPose pose;
  for (int i = 0; i < 80 && !tracking.tracker.takeRestPose(pose); ++i) tracking(scene.shoot());
  Bump bump{.centre = {draw(200.0, 440.0), draw(160.0, 320.0)}, .width_px = draw(40.0, 80.0)};
  const Eigen::Vector2d peak(draw(-7.0, 7.0), draw(-7.0, 7.0));
  for (int step = 1; step <= 8; ++step) {
    bump.peak_px = peak * (step / 8.0);
    scene.displace(bump);
    tracking(scene.shoot());
  }
  const Comparison load = compare(scene, tracking.field);
  const std::vector<double> bounds = boundsOf(scene, gel.optics, 1.0);
  double bound = 0.0;
  int there = 0, count = 0;
  for (int i = 0; i < scene.markers(); ++i) {
    there += scene.rest.col(i).allFinite();
    if (!tracking.field.valid[i]) continue;
    bound += bounds[i];
    ++count;
  }
  const auto found = std::count(pose.present.begin(), pose.present.end(), 1);
  std::cout << name << '\t' << there << '\t' << found << '\t' << load.valid << '\t' << load.wrong << '\t'
            << load.rms_px / std::sqrt(bound / std::max(count, 1)) << '\t' << load.ratio << '\t'
            << 2.0 * markerRadius(gel.sensor, gel.sensor.layers[0]) << '\n';
}

}  // namespace

int main(int argc, char** argv) {
  std::uint64_t seed = 0;
  int trials = 10;
  CLI::App app("Tracks gels that are drawn at random, family after family.", "evaluation_markers");
  app.add_option("--seed", seed)->capture_default_str();
  app.add_option("--trials", trials, "of each family")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  Draw draw(seed);
  for (int i = 0; i < trials; ++i) run("plain", plainGel(draw), draw);
  for (const auto& [name, change] : families()) {
    for (int i = 0; i < trials; ++i) {
      Gel gel = plainGel(draw);
      change(gel, draw, 1.0);
      run(name, gel, draw);
    }
  }
  for (int i = 0; i < trials; ++i) {
    Gel gel = plainGel(draw);
    for (const auto& [name, change] : families()) change(gel, draw, 0.4);
    run("all, 40 %", gel, draw);
  }
}

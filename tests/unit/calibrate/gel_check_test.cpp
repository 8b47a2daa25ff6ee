// Pictures of one gel, and the file of another.
#include "daemon/calibrate/gel_check.h"
#include "tests/unit/track/scene.h"

#include <gtest/gtest.h>

#include <cstdio>

namespace tractiond::calibrate::gel_check_test {
namespace {

/// What the daemon would find in pictures of `truth`, had it this gel file. Nothing: no zero could be taken.
std::optional<GelReport> checked(const sensor::Sensor& truth, const sensor::Sensor& file, unsigned seed = 1,
                                 twin::Format format = twin::Format::kRgb8) {
  track::Scene scene({}, format, truth);
  scene.remove(0.03, seed);
  track::Tracker tracker(file, {});
  MarkerField field;
  field.resize(file.markerCount());
  RestPose pose;
  for (int i = 0; i < 45; ++i) {
    tracker.track(scene.shoot(), field);
    if (!tracker.takeRestPose(pose)) continue;
    MarkerSight sight;
    EXPECT_TRUE(tracker.takeSight(sight));
    std::vector<LatticeSeen> seen;
    for (int k = 0; k < sight.layerCount; ++k) seen.push_back(sight.layers[static_cast<std::size_t>(k)].seen);
    return checkGel(file, pose.position_px, pose.present, seen);
  }
  return std::nullopt;
}

const GelReport::Finding& find(const GelReport& report, const std::string& name) {
  for (const GelReport::Finding& finding : report.findings) {
    if (finding.name == name) return finding;
  }
  ADD_FAILURE() << name;
  static const GelReport::Finding none;
  return none;
}

/// The numbers that a gel file may have wrong, drawn as far off as it says they may be.
struct Draw {
  explicit Draw(unsigned seed)
      : random(seed) {}
  double normal(double deviation) { return std::normal_distribution<double>(0.0, deviation)(random); }

  sensor::Sensor trueSensor(const sensor::Sensor& file) {
    sensor::Sensor truth = file;
    const sensor::Uncertainty& known = file.uncertainty;
    truth.camera.focal_px *= 1.0 + normal(known.focal);
    truth.camera.principal_px += Eigen::Vector2d(normal(known.principal_px), normal(known.principal_px));
    for (int axis = 0; axis < 3; ++axis) {
      truth.camera.position[axis] += normal(known.position[axis]);
      truth.camera.rotation[axis] += normal(known.rotation[axis]);
    }
    for (sensor::MarkerLayer& layer : truth.layers) layer.depth += normal(known.layerDepth);
    return truth;
  }

  std::mt19937 random;
};

/// Markers that a hand has placed, 0.3 mm from their grid: more than a tenth of the pitch.
TEST(GelCheck, MarkersOffTheirGridAreAnAlarmUnlessTheFileSaysSo) {
  const sensor::Sensor file;
  sensor::Sensor truth = file;
  std::mt19937 random(12);
  std::normal_distribution<double> normal(0.0, 0.32e-3);
  truth.scatter = sensor::Points::Zero(3, truth.markerCount());
  for (double& offset : truth.scatter.topRows<2>().reshaped()) offset = normal(random);
  const auto report = checked(truth, file);
  ASSERT_TRUE(report);
  EXPECT_NE(report->remark.find("write marker_place_mm = 0.3"), std::string::npos) << report->remark;
  sensor::Sensor stated = file;
  stated.uncertainty.markerPlace = 0.3e-3;
  const auto again = checked(truth, stated);
  ASSERT_TRUE(again);
  EXPECT_TRUE(again->fits()) << again->remark;
}

/// Sixteen markers tell of their pitch and of where the camera is.
TEST(GelCheck, FewMarkersFitTheirFileAndContradictAnothers) {
  sensor::Sensor file;
  file.layers.resize(1);
  file.layers[0].columns = file.layers[0].rows = 4;
  file.layers[0].pitch = 15e-3;
  file.layers[0].diameter = 2e-3;
  const auto report = checked(file, file);
  ASSERT_TRUE(report);
  EXPECT_TRUE(report->fits()) << report->remark;
  sensor::Sensor other = file;
  other.layers[0].pitch = 16e-3;
  const auto wrong = checked(file, other);
  ASSERT_TRUE(wrong);
  EXPECT_TRUE(find(*wrong, "pitch_mm").contradicts) << wrong->remark;
}

TEST(GelCheck, AGelAsUncertainAsItsFileSaysIsNoAlarm) {
  constexpr unsigned kSeed = 4711;
  constexpr int kGels = 30;
  Draw draw(kSeed);
  int alarms = 0;
  double largest = 0.0;
  for (int i = 0; i < kGels; ++i) {
    const sensor::Sensor file;
    const auto report = checked(draw.trueSensor(file), file, static_cast<unsigned>(i),
                                i % 2 ? twin::Format::kBayerRG8 : twin::Format::kRgb8);
    ASSERT_TRUE(report) << i;
    if (!report->fits()) ++alarms;
    EXPECT_TRUE(report->fits()) << i << ": " << report->remark;
    for (const auto& finding : report->findings) {
      if (finding.deviation > 0.0) {
        largest = std::max(largest, std::abs(finding.seen - finding.expected) / finding.deviation);
      }
    }
  }
  std::printf("seed %u: %d alarms in %d gels, the largest difference %.1f deviations\n", kSeed, alarms, kGels, largest);
  EXPECT_EQ(alarms, 0);
}

TEST(GelCheck, WrongNumbersOfTheLayersAreNoticed) {
  using Layers = std::vector<sensor::MarkerLayer>;
  struct Case {
    const char *finding, *says;
    void (*spoil)(Layers& layers);
  };
  const auto pitched = [](Layers& layers, double share) {
    for (sensor::MarkerLayer& layer : layers) layer.pitch *= share;
  };
  static const auto pitch = pitched;
  Draw draw(1);
  for (const Case& c : {Case{"pitch_mm", "check pitch_mm", [](Layers& layers) { pitch(layers, 0.97); }},
                        {"pitch_mm", "check pitch_mm", [](Layers& layers) { pitch(layers, 1.03); }},
                        {"layer_distance_mm", "depth_mm", [](Layers& layers) { layers[0].depth *= 0.8; }},
                        {"layer_distance_mm", "depth_mm", [](Layers& layers) { layers[1].depth *= 1.2; }},
                        {"layer_distance_mm", "depth_mm of the two layers seems to be exchanged",
                         [](Layers& layers) { std::swap(layers[0].depth, layers[1].depth); }},
                        {"layer_distance_mm", "exchange colour of the two [[layers]]",
                         [](Layers& layers) {
                           std::swap(layers[0].depth, layers[1].depth);
                           std::swap(layers[0].centre, layers[1].centre);
                         }},
                        {"layer_offset_x_mm", "turned by 90° clockwise or mirrored left to right",
                         [](Layers& layers) { layers[1].centre.x() *= -1.0; }},
                        {"layer_offset_y_mm", "check centre_mm", [](Layers& layers) { layers[1].centre.y() = 0.0; }}}) {
    sensor::Sensor file;
    const sensor::Sensor truth = draw.trueSensor(file);
    c.spoil(file.layers);
    const auto report = checked(truth, file);
    ASSERT_TRUE(report);
    EXPECT_FALSE(report->fits());
    EXPECT_TRUE(find(*report, c.finding).contradicts) << report->remark;
    EXPECT_NE(report->remark.find(c.says), std::string::npos) << report->remark;
  }
}

TEST(GelCheck, AnotherNumberOfMarkersIsNoticedBothWaysRound) {
  const auto grid = [](int columns, int rows) {
    sensor::Sensor sensor;
    for (sensor::MarkerLayer& layer : sensor.layers) {
      layer.columns = columns;
      layer.rows = rows;
    }
    return sensor;
  };
  for (const auto& [columns, rows] : {std::pair(20, 20), {25, 24}, {24, 23}}) {
    for (const bool inFile : {false, true}) {
      const auto report =
          inFile ? checked(grid(24, 24), grid(columns, rows)) : checked(grid(columns, rows), grid(24, 24));
      ASSERT_TRUE(report) << columns << " x " << rows;
      EXPECT_FALSE(report->fits()) << columns << " x " << rows << (inFile ? " in the file" : " in the picture");
      std::printf("%d x %d %s: %s\n", columns, rows, inFile ? "in the file" : "in the picture", report->remark.c_str());
    }
  }
}

TEST(GelCheck, AnotherScaleInXAndYIsNamed) {
  Draw draw(5);
  for (const bool oneLayer : {false, true}) {
    for (const double aspect : {1.035, 0.965}) {
      sensor::Sensor file;
      if (oneLayer) file.layers.pop_back();
      file.camera.position.z() = 170e-3;  // so that all rows stay in the picture
      sensor::Sensor truth = draw.trueSensor(file);
      truth.camera.aspect = aspect;
      const auto report = checked(truth, file);
      ASSERT_TRUE(report) << aspect;
      const auto& found = find(*report, "aspect");
      EXPECT_TRUE(found.contradicts);
      EXPECT_NEAR(found.seen, aspect, 1e-3);
      for (const auto& other : report->findings) EXPECT_EQ(other.contradicts, other.name == "aspect") << other.name;
      EXPECT_EQ(report->remark.substr(0, 39), "the picture's scale differs in x and y:") << report->remark;
      std::printf("%s\n", report->remark.c_str());
      // A file that has it fits.
      file.camera.aspect = aspect;
      const auto right = checked(truth, file);
      ASSERT_TRUE(right);
      EXPECT_TRUE(right->fits()) << right->remark;
    }
  }
}

}  // namespace
}  // namespace tractiond::calibrate::gel_check_test

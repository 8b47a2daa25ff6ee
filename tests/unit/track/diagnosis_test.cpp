// Pictures in which no markers are found, and what is said of them.
#include "daemon/track/diagnosis.h"
#include "sensor/influence_file.h"
#include "tests/unit/track/scene.h"

#include <gtest/gtest.h>

namespace tractiond::track::diagnosis_test {
namespace {

std::string said(const sensor::Sensor& file, Scene& scene) {
  Tracker tracker(file, {});
  MarkerField field;
  field.resize(file.markerCount());
  MarkerSight sight;
  for (int i = 0; i < 5; ++i) tracker.track(scene.shoot(), field);
  EXPECT_TRUE(tracker.takeSight(sight));
  const std::string text = diagnose(file, sight, plainPicture(scene.shoot()));
  std::printf("%s\n", text.c_str());
  return text;
}

std::string said(const twin::Optics& optics, twin::Format format = twin::Format::kRgb8) {
  Scene scene(optics, format);
  return said(scene.sensor, scene);
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(Diagnosis, CountsWhatIsFound) {
  EXPECT_TRUE(contains(said(twin::Optics{}), "of 576 markers, red: 5"));
}

TEST(Diagnosis, ADarkASaturatedAndAnEvenPicture) {
  const auto optics = [](double contrast, double background, double noise) {
    twin::Optics made;
    made.contrast = contrast;
    made.background = background;
    made.readNoise = noise;
    return made;
  };
  EXPECT_TRUE(contains(said(optics(4.0, 3.0, 2.0)), "dark"));
  EXPECT_TRUE(contains(said(optics(4.0, 3.0, 2.0), twin::Format::kBayerGR8), "dark"));
  EXPECT_TRUE(contains(said(optics(100.0, 255.0, 2.0)), "saturated"));
  EXPECT_TRUE(contains(said(optics(1.0, 100.0, 0.5)), "even"));
}

TEST(Diagnosis, MarkersOfAnotherSize) {
  sensor::Sensor truth;
  for (sensor::MarkerLayer& layer : truth.layers) layer.diameter = 2e-3;
  Scene scene({}, twin::Format::kRgb8, truth);
  EXPECT_TRUE(contains(said(sensor::Sensor{}, scene), "times the size"));
}

TEST(Diagnosis, MarkersOfAnotherColour) {
  sensor::Sensor file;
  file.layers.pop_back();
  sensor::Sensor truth = file;
  truth.layers[0].colour = sensor::Colour::kRed;
  Scene scene({}, twin::Format::kRgb8, truth);
  EXPECT_TRUE(contains(said(file, scene), "red spots"));
}

TEST(Diagnosis, AnotherPitch) {
  sensor::Sensor truth;
  for (sensor::MarkerLayer& layer : truth.layers) layer.pitch = 1.9e-3;
  Scene scene({}, twin::Format::kRgb8, truth);
  EXPECT_TRUE(contains(said(sensor::Sensor{}, scene), "px apart instead of"));
}

TEST(Diagnosis, RandomDotsBesideTheirPlaces) {
  sensor::Sensor dots;
  dots.layers.pop_back();
  sensor::Body body{.file = "dots.npz",
                    .youngsModulus = 1.0,
                    .influence = {},
                    .nodes = sensor::nodePositions(dots),
                    .normals = sensor::nodeNormals(dots),
                    .areas = sensor::nodeAreas(dots),
                    .markers = sensor::markerPositions(dots),
                    .errors = {}};
  std::mt19937 generator(7);
  std::uniform_real_distribution<double> beside(-0.9e-3, 0.9e-3);
  for (Eigen::Index i = 0; i < body.markers.cols(); ++i) {
    body.markers.col(i) += Eigen::Vector3d(beside(generator), beside(generator), 0.0);
  }
  ASSERT_TRUE(sensor::setBody(dots, std::move(body)));
  Scene scene({}, twin::Format::kRgb8, dots);
  scene.now = scene.rest.colwise() + Eigen::Vector2d(27.0, 27.0);
  const std::string text = said(dots, scene);
  EXPECT_TRUE(contains(text, "that do not lie in a grid")) << text;
}

}  // namespace
}  // namespace tractiond::track::diagnosis_test

// Pictures in which no markers are found, and what is said of them.
#include "daemon/track/diagnosis.h"
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

TEST(Diagnosis, ADarkPicture) {
  twin::Optics optics;
  optics.contrast = 4.0;
  optics.background = 3.0;
  for (const auto format : {twin::Format::kRgb8, twin::Format::kBayerGR8}) {
    EXPECT_TRUE(contains(said(optics, format), "dark"));
  }
}

TEST(Diagnosis, ASaturatedPicture) {
  twin::Optics optics;
  optics.background = 255.0;
  EXPECT_TRUE(contains(said(optics), "saturated"));
}

TEST(Diagnosis, AnEvenPicture) {
  twin::Optics optics;
  optics.contrast = 1.0;
  optics.background = 100.0;
  optics.readNoise = 0.5;
  EXPECT_TRUE(contains(said(optics), "even"));
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

}  // namespace
}  // namespace tractiond::track::diagnosis_test

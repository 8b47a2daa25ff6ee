// Pictures in which no markers are found, and what is said of them.
#include "daemon/track/diagnosis.h"
#include "tests/unit/track/scene.h"

#include <gmock/gmock.h>
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

TEST(Diagnosis, CountsWhatIsFound) {
  EXPECT_THAT(said(twin::Optics{}), testing::HasSubstr("of 576 markers, red: 5"));
}

TEST(Diagnosis, ADarkASaturatedAndAnEvenPicture) {
  const auto saidOf = [](double contrast, double background, double noise, twin::Format format) {
    twin::Optics made;
    made.contrast = contrast;
    made.background = background;
    made.readNoise = noise;
    return said(made, format);
  };
  EXPECT_THAT(saidOf(4.0, 3.0, 2.0, twin::Format::kRgb8), testing::HasSubstr("dark"));
  EXPECT_THAT(saidOf(4.0, 3.0, 2.0, twin::Format::kBayerGR8), testing::HasSubstr("dark"));
  EXPECT_THAT(saidOf(100.0, 255.0, 2.0, twin::Format::kRgb8), testing::HasSubstr("saturated"));
  EXPECT_THAT(saidOf(1.0, 100.0, 0.5, twin::Format::kRgb8), testing::HasSubstr("even"));
}

TEST(Diagnosis, MarkersOfAnotherSizeColourOrPitch) {
  const auto saidOf = [](const sensor::Sensor& truth, const sensor::Sensor& file) {
    Scene scene({}, twin::Format::kRgb8, truth);
    return said(file, scene);
  };
  sensor::Sensor large, wide;
  for (sensor::MarkerLayer& layer : large.layers) layer.diameter = 2e-3;
  for (sensor::MarkerLayer& layer : wide.layers) layer.pitch = 1.9e-3;
  EXPECT_THAT(saidOf(large, {}), testing::HasSubstr("times the size"));
  EXPECT_THAT(saidOf(wide, {}), testing::HasSubstr("px apart instead of"));
  sensor::Sensor blue;
  blue.layers.pop_back();
  sensor::Sensor red = blue;
  red.layers[0].colour = sensor::Colour::kRed;
  EXPECT_THAT(saidOf(red, blue), testing::HasSubstr("red spots"));
}

}  // namespace
}  // namespace tractiond::track::diagnosis_test

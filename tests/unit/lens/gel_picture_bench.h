// Pictures of a gel behind a camera that is not where the gel file has it.
#pragma once

#include "lens/commands.h"
#include "lens/rest_markers.h"
#include "sensor/gel_file.h"
#include "tests/support/seed.h"
#include "tests/unit/lens/workplace.h"
#include "twin/renderer.h"

#include <opencv2/core.hpp>

#include <random>

namespace lens::gel_picture_commands_test {

inline constexpr double kOff = 20e-3;                      // along each axis [m]
inline constexpr double kTurned = 5.0 * 3.14159265 / 180;  // about each axis [rad]

/// A gel behind a camera that is not where the gel file has it.
class GelPictureCommands : public Workplace {
 protected:
  GelPictureCommands() {
    truth.camera.focal_px = 860.0;  // so that all markers stay in the picture
    truth.gel.size.z() = 20e-3;
    if (between(0, 1) > 0.5) {
      truth.camera.gelIndex = 1.41;
      truth.camera.windowIndex = 1.49;
      truth.camera.windowThickness = 5e-3;
    }
    options.gel = path("in.toml");
    options.picture = path("rest.png");
    options.output = path("out.png");
  }

  double between(double least, double most) { return std::uniform_real_distribution<double>(least, most)(generator); }

  Eigen::Vector3d within(double most) { return {between(-most, most), between(-most, most), between(-most, most)}; }

  /// Returns the picture of a monochrome camera, of the truth's darker markers. Sets `places`.
  cv::Mat photographGrey() {
    twin::Optics optics;
    optics.background = 150.0;
    twin::Renderer renderer(truth, optics, twin::Format::kMono8);
    const sensor::Projection project(truth.camera, truth.gel.size.z());
    const sensor::Points points = sensor::markerPositions(truth);
    places.resize(2, points.cols());
    for (Eigen::Index i = 0; i < points.cols(); ++i) places.col(i) = project(points.col(i));
    cv::Mat picture(truth.camera.height, truth.camera.width, CV_8UC1);
    renderer.render(places, static_cast<std::uint32_t>(generator()), {picture.data, picture.total()});
    return picture;
  }

  cv::Mat photograph(double blur_px = 0.8) {
    twin::Optics optics;
    optics.blur_px = blur_px;
    twin::Renderer renderer(truth, optics, twin::Format::kBgr8);
    const sensor::Projection project(truth.camera, truth.gel.size.z());
    const sensor::Points points = sensor::markerPositions(truth);
    places.resize(2, points.cols());
    std::normal_distribution<double> misprint_px;
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      places.col(i) = project(points.col(i));
      if (printed_px == 0.0) continue;
      for (double& coordinate : places.col(i)) coordinate += printed_px * misprint_px(generator);
    }
    cv::Mat picture(truth.camera.height, truth.camera.width, CV_8UC3);
    renderer.render(places, static_cast<std::uint32_t>(generator()), {picture.data, picture.total() * 3});
    return picture;
  }

  /// Writes a gel file of the camera's true lens, and a pose that is not its own.
  void writeGelFile(double aspect) {
    sensor::Sensor file = truth;
    file.camera.position = Eigen::Vector3d(0, 0, 157e-3) + within(kOff);
    file.camera.rotation = within(kTurned);
    file.camera.aspect = aspect;
    write(options.gel, sensor::gelText(file));
  }

  /// Has the pose found by picture and gel file, and holds it against the truth, within five stated deviations,
  /// of which that of the position is below `mostDeviation` [m].
  void expectPosed(double mostDeviation = 2e-3) {
    std::filesystem::remove(options.output);
    const Done done = pose(options, report);
    ASSERT_TRUE(done) << done.error()[0].message();
    const auto found = sensor::loadGel(options.output);
    ASSERT_TRUE(found) << found.error().what;
    EXPECT_EQ(found->camera.aspect, truth.camera.aspect);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(found->camera.position[i], truth.camera.position[i], 5 * found->uncertainty.position[i]);
      EXPECT_NEAR(found->camera.rotation[i], truth.camera.rotation[i], 5 * found->uncertainty.rotation[i]);
    }
    EXPECT_LT(found->uncertainty.position.norm(), mostDeviation);
    EXPECT_LT(found->uncertainty.rotation.norm(), 0.02);
  }

  RestMarkers noisyMarkers(double noise_px);

  std::mt19937 generator{tractiond::test::seed()};
  sensor::Sensor truth;
  double printed_px = 0.0;  ///< deviation of each marker from its place in the pattern
  Eigen::Matrix2Xd places;  ///< px
  PoseOptions options;
};

/// Places of all markers with noise, as a tracker finds them in one picture.
inline RestMarkers GelPictureCommands::noisyMarkers(double noise_px) {
  const sensor::Projection project(truth.camera, truth.gel.size.z());
  const sensor::Points points = sensor::markerPositions(truth);
  std::normal_distribution<double> noise(0.0, noise_px);
  RestMarkers markers;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Vector2d place = project(points.col(i));
    for (const double coordinate : place) markers.place_px.push_back(static_cast<float>(coordinate + noise(generator)));
  }
  markers.present.assign(static_cast<std::size_t>(points.cols()), 1);
  return markers;
}

}  // namespace lens::gel_picture_commands_test

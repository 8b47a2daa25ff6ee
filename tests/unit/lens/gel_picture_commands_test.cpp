#include "lens/commands.h"
#include "lens/first_pose.h"
#include "lens/picture_file.h"
#include "sensor/gel_file.h"
#include "tests/support/seed.h"
#include "tests/unit/lens/workplace.h"
#include "twin/renderer.h"

#include <opencv2/imgproc.hpp>

#include <random>

namespace lens::gel_picture_commands_test {
namespace {

constexpr double kOff = 20e-3;                      // along each axis [m]
constexpr double kTurned = 5.0 * 3.14159265 / 180;  // about each axis [rad]

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
    options.output = path("out");
  }

  double between(double least, double most) { return std::uniform_real_distribution<double>(least, most)(generator); }

  Eigen::Vector3d within(double most) { return {between(-most, most), between(-most, most), between(-most, most)}; }

  cv::Mat photograph(double blur_px = 0.8) {
    twin::Optics optics;
    optics.blur_px = blur_px;
    twin::Renderer renderer(truth, optics, twin::Format::kBgr8);
    const sensor::Projection project(truth.camera, truth.gel.size.z());
    const sensor::Points points = sensor::markerPositions(truth);
    places.resize(2, points.cols());
    for (Eigen::Index i = 0; i < points.cols(); ++i) places.col(i) = project(points.col(i));
    cv::Mat picture(truth.camera.height, truth.camera.width, CV_8UC3);
    renderer.render(places, static_cast<std::uint32_t>(generator()), {picture.data, picture.total() * 3});
    return picture;
  }

  std::mt19937 generator{tractiond::test::seed()};
  sensor::Sensor truth;
  Eigen::Matrix2Xd places;  ///< px
  PictureOptions options;
};

TEST_F(GelPictureCommands, PoseIsFoundFromAWrongOne) {
  for (int trial = 0; trial < 5; ++trial) {
    sensor::Sensor believed = truth;  // the middle of what is possible
    believed.camera.position = {0, 0, 157e-3};
    truth.camera.position = believed.camera.position + within(2e-3);
    truth.camera.rotation = within(0.01);
    write(options.gel, [&] {
      sensor::Sensor file = believed;
      file.camera.position += within(kOff);
      file.camera.rotation = within(kTurned);
      return sensor::gelText(file);
    }());
    ASSERT_TRUE(writePicture(options.picture, photograph()));
    const Done done = pose(options);
    ASSERT_TRUE(done) << done.error()[0].message();
    const auto found = sensor::loadGel(options.output);
    ASSERT_TRUE(found) << found.error().what;
    const sensor::Uncertainty& known = found->uncertainty;
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(found->camera.position[i], truth.camera.position[i], 5 * known.position[i]);
      EXPECT_NEAR(found->camera.rotation[i], truth.camera.rotation[i], 5 * known.rotation[i]);
    }
    EXPECT_LT(known.position.norm(), 2e-3);
    EXPECT_LT(known.rotation.norm(), 0.02);
  }
}

/// However far off: solvePnP is told of no start at all.
TEST_F(GelPictureCommands, SolvedPoseNeedsNoStart) {
  for (int trial = 0; trial < 50; ++trial) {
    truth.camera.position = Eigen::Vector3d(0, 0, 157e-3) + within(40e-3);
    truth.camera.rotation = within(0.2);
    photograph();
    RestMarkers markers;
    for (Eigen::Index i = 0; i < places.size(); ++i) markers.place_px.push_back(static_cast<float>(places.data()[i]));
    markers.present.assign(static_cast<std::size_t>(places.cols()), 1);
    sensor::Sensor believed = truth;
    believed.camera.position = {0, 0, 157e-3};
    believed.camera.rotation.setZero();
    const auto solved = solvePose(believed, markers);
    ASSERT_TRUE(solved);
    // What refraction off the axis does is for the refinement.
    EXPECT_LT((solved->position - truth.camera.position).norm(), 10e-3);
    EXPECT_LT((solved->rotation - truth.camera.rotation).norm(), 0.1);
    const auto refined = firstPose(believed, markers);
    ASSERT_EQ(refined.outcome, tractiond::calibrate::Geometry::Outcome::kConverged);
    EXPECT_LT(refined.residual_px, 1e-3);
  }
}

TEST_F(GelPictureCommands, MarkDrawsACircleOnEachMarker) {
  write(options.gel, sensor::gelText(truth));
  const cv::Mat plain = photograph();
  ASSERT_TRUE(writePicture(options.picture, plain));
  const Done done = mark(options);
  ASSERT_TRUE(done) << done.error()[0].message();
  const auto marked = readPicture(options.output);
  ASSERT_TRUE(marked);
  ASSERT_EQ(marked->cols, 2 * plain.cols);
  int circles = 0;
  for (const auto& place : places.colwise()) {
    // To the right of the centre by the circle's radius: pure blue and green, or green and red.
    const cv::Vec3b on = marked->at<cv::Vec3b>(static_cast<int>(std::lround(2 * place.y() + 0.5)),
                                               static_cast<int>(std::lround(2 * place.x() + 0.5 + 5)));
    circles += on[1] > 150 ? 1 : 0;
  }
  EXPECT_GT(circles, 0.95 * static_cast<double>(places.cols()));
}

/// Black dots behind a monochrome camera.
TEST_F(GelPictureCommands, DarkDotsInAGreyPicture) {
  truth.layers.resize(1);
  truth.layers[0].colour = sensor::Colour::kGrey;
  truth.layers[0].darker = true;
  twin::Optics optics;
  optics.background = 150.0;
  twin::Renderer renderer(truth, optics, twin::Format::kMono8);
  const sensor::Projection project(truth.camera, truth.gel.size.z());
  const sensor::Points points = sensor::markerPositions(truth);
  places.resize(2, points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) places.col(i) = project(points.col(i));
  cv::Mat picture(truth.camera.height, truth.camera.width, CV_8UC1);
  renderer.render(places, static_cast<std::uint32_t>(generator()), {picture.data, picture.total()});
  const auto found = findMarkers(picture, truth);
  ASSERT_TRUE(found) << found.error();
  EXPECT_EQ(found->count(), truth.markerCount());
  for (Eigen::Index i = 0; i < places.size(); ++i) {
    EXPECT_NEAR(found->place_px[static_cast<std::size_t>(i)], places.data()[i], 0.3);
  }
  // Two layers that only colours tell apart cannot be found in it.
  truth.layers = sensor::paperLayers();
  EXPECT_FALSE(findMarkers(picture, truth));
}

TEST_F(GelPictureCommands, WhatShowsNoGelIsRefused) {
  write(options.gel, sensor::gelText(truth));
  cv::Mat picture = photograph();
  const auto refuse = [&](const cv::Mat& spoilt, const std::string& what) {
    ASSERT_TRUE(writePicture(options.picture, spoilt));
    for (const auto command : {pose, mark}) {
      const Done done = command(options);
      ASSERT_FALSE(done) << what;
      EXPECT_EQ(done.error()[0].where, options.picture);
      EXPECT_NE(done.error()[0].what.find(what), std::string::npos) << done.error()[0].message();
      EXPECT_EQ(done.error()[0].exitCode, EX_DATAERR);
      EXPECT_FALSE(std::filesystem::exists(options.output));
    }
  };
  refuse(cv::Mat(picture.size(), CV_8UC3, cv::Scalar(20, 20, 20)), "shows too few markers");
  cv::Mat noise(picture.size(), CV_8UC3);
  cv::theRNG().state = generator();
  cv::randu(noise, cv::Scalar::all(0), cv::Scalar::all(256));
  refuse(noise, "shows too few markers");
  cv::Mat blurred;
  cv::GaussianBlur(picture, blurred, {}, 12.0);
  refuse(blurred, "shows too few markers");
  cv::Mat smaller;
  cv::resize(picture, smaller, {}, 0.5, 0.5);
  refuse(smaller, "has 320 x 240 px");
  ASSERT_TRUE(writePicture(options.picture, picture));
  const std::string whole = content(options.picture);
  write(options.picture, whole.substr(0, generator() % whole.size()));
  EXPECT_FALSE(pose(options));
  EXPECT_FALSE(std::filesystem::exists(options.output));
}

}  // namespace
}  // namespace lens::gel_picture_commands_test

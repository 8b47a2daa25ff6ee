// The pose from a picture of the gel, the marks in one, and pictures that show none.
#include "client/show/png_file.h"
#include "lens/picture_file.h"
#include "tests/unit/lens/gel_picture_bench.h"

#include <opencv2/imgproc.hpp>

#include <cstdio>

namespace lens::gel_picture_commands_test {
namespace {

TEST_F(GelPictureCommands, PoseIsFoundFromAWrongOne) {
  for (int trial = 0; trial < 3; ++trial) {
    truth.camera.position = Eigen::Vector3d(0, 0, 157e-3) + within(2e-3);
    truth.camera.rotation = within(0.01);
    writeGelFile(1.0);
    ASSERT_TRUE(writePicture(options.picture, photograph()));
    expectPosed();
  }
}

TEST_F(GelPictureCommands, ALensOfAnotherCameraIsRefusedByName) {
  const std::string a = "Maker-A (640 x 480 px)", b = "Maker-B (640 x 480 px)";
  const auto take = [&](const std::string& with) {
    cv::Mat rgb;
    cv::cvtColor(photograph(), rgb, cv::COLOR_BGR2RGB);
    traction::client::writePng(options.picture, 640, 480, 3, rgb.data, with);
  };
  const auto expectRefused = [&](const std::string& with) {
    const Done done = pose(options, report);
    ASSERT_FALSE(done);
    EXPECT_EQ(done.error()[0].exitCode, EX_DATAERR);
    EXPECT_EQ(done.error()[0].what, "is of " + with + ", the lens of " + options.gel + " was measured with " + a);
    EXPECT_FALSE(std::filesystem::exists(options.output));
    std::printf("  the lens of camera A, a picture of %s: %s; right: refused by name\n", with.c_str(),
                done.error()[0].what.c_str());
  };
  const auto boundTo = [&] { return sensor::loadGel(options.output)->measuredWith; };
  truth.measuredWith = a;
  writeGelFile(1.0);
  take(b);
  expectRefused(b);
  options.sameLens = true;
  expectPosed();
  EXPECT_EQ(boundTo(), b);
  EXPECT_EQ(sensor::loadGel(options.output)->uncertainty.principal_px, 5.0);
  std::filesystem::remove(options.output);
  take("Maker-B (640 x 480 px, ReverseX = true)");  // no lens is the same there
  expectRefused("Maker-B (640 x 480 px, ReverseX = true)");
  options.sameLens = false;
  take(a);
  expectPosed();
  EXPECT_EQ(boundTo(), a);
  take("");  // of other programs
  expectPosed();
  EXPECT_EQ(boundTo(), a);
  truth.measuredWith.clear();  // a file of before
  writeGelFile(1.0);
  take(b);
  expectPosed();
  EXPECT_EQ(boundTo(), b);
}

/// No lens and no pose moves each marker another way.
TEST_F(GelPictureCommands, APoseThatFitsBadlyIsWrittenIfAskedFor) {
  for (sensor::MarkerLayer& layer : truth.layers) layer.columns = layer.rows = 12;
  truth.camera.position = {0, 0, 165e-3};
  printed_px = 1.0;
  ASSERT_TRUE(writePicture(options.picture, photograph()));
  write(options.gel, sensor::gelText(truth));
  const Done refused = pose(options, report);
  ASSERT_FALSE(refused);
  const tractiond::Error& error = refused.error()[0];
  double left_px = 0.0, limit_px = 0.0, offered_px = 0.0;
  ASSERT_EQ(std::sscanf(error.what.c_str(),
                        "does not fit the gel file: %lf px are left of the markers' places, at most %lf", &left_px,
                        &limit_px),
            2)
      << error.message();
  EXPECT_NEAR(left_px, printed_px, 0.2);
  EXPECT_EQ(limit_px, 0.5);
  const std::size_t at = error.remedy.find("--accept-residual ");
  ASSERT_NE(at, std::string::npos) << error.message();
  ASSERT_EQ(std::sscanf(error.remedy.c_str() + at, "--accept-residual %lf", &offered_px), 1) << error.message();
  EXPECT_FALSE(std::filesystem::exists(options.output));
  options.acceptResidual_px = offered_px;
  const Done done = pose(options, report);
  const std::string printed = report.text();
  ASSERT_TRUE(done) << done.error()[0].message();
  EXPECT_NE(printed.find("warning: "), std::string::npos) << printed;
  const auto found = sensor::loadGel(options.output);
  ASSERT_TRUE(found) << found.error().what;
  EXPECT_LT((found->camera.position - truth.camera.position).norm(), 5e-3);
}

/// A ring is seen if it differs much from what it surrounds and lies beside the marker's disc, be that small or large.
TEST_F(GelPictureCommands, MarkDrawsARingAroundEachMarker) {
  for (const double diameter : {0.6e-3, 1.2e-3}) {
    for (sensor::MarkerLayer& layer : truth.layers) layer.diameter = diameter;
    write(options.gel, sensor::gelText(truth));
    const cv::Mat plain = photograph();
    ASSERT_TRUE(writePicture(options.picture, plain));
    const Done done = mark(options, report);
    ASSERT_TRUE(done) << done.error()[0].message();
    const auto marked = readPicture(options.output);
    ASSERT_TRUE(marked);
    ASSERT_EQ(marked->cols, 2 * plain.cols);
    const double radius_px = 0.5 * diameter * truth.camera.focal_px / (truth.camera.position.z() - 7e-3);
    int rings = 0;
    for (const auto& place : places.colwise()) {
      const auto levelAt = [&](double beside_px) {  // from the marker's centre [px of the picture]
        const cv::Vec3b on = marked->at<cv::Vec3b>(static_cast<int>(std::lround(2 * place.y() + 0.5)),
                                                   static_cast<int>(std::lround(2 * (place.x() + beside_px) + 0.5)));
        return std::max(on[0], on[2]) > 150 && on[1] > 150;
      };
      bool isRinged = false;
      for (double beside_px = radius_px + 0.5; beside_px < radius_px + 4.0; beside_px += 0.5) {
        isRinged = isRinged || levelAt(beside_px);
      }
      rings += isRinged ? 1 : 0;
    }
    EXPECT_GT(rings, 0.95 * static_cast<double>(places.cols())) << diameter;
  }
}

/// Black dots behind a monochrome camera.
TEST_F(GelPictureCommands, DarkDotsInAGreyPicture) {
  truth.layers.resize(1);
  truth.layers[0].colour = sensor::Colour::kGrey;
  truth.layers[0].darker = true;
  const cv::Mat picture = photographGrey();
  const auto found = findMarkers(picture, truth);
  ASSERT_TRUE(found) << found.error().what;
  EXPECT_EQ(found->count(), truth.markerCount());
  for (Eigen::Index i = 0; i < places.size(); ++i) {
    EXPECT_NEAR(found->place_px[static_cast<std::size_t>(i)], places.data()[i], 0.3);
  }
  // Two layers that only colours tell apart cannot be found in it.
  truth.layers = sensor::paperLayers();
  EXPECT_FALSE(findMarkers(picture, truth));
}

TEST_F(GelPictureCommands, FourByFourMarkersTellAPose) {
  truth.layers.resize(1);
  sensor::MarkerLayer& layer = truth.layers[0];
  layer.pitch = 12e-3;
  layer.diameter = 2e-3;
  layer.columns = layer.rows = 3;
  write(options.gel, sensor::gelText(truth));
  ASSERT_TRUE(writePicture(options.picture, photograph()));
  const Done done = pose(options, report);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error()[0].what, "cannot be searched: a marker layer of fewer than 4 x 4 markers");

  layer.columns = layer.rows = 4;
  ASSERT_TRUE(writePicture(options.picture, photograph()));
  writeGelFile(truth.camera.aspect);
  expectPosed(0.1);
}

TEST_F(GelPictureCommands, WhatShowsNoGelIsRefused) {
  write(options.gel, sensor::gelText(truth));
  cv::Mat picture = photograph();
  const auto refuse = [&](const cv::Mat& spoilt, const std::string& what) {
    ASSERT_TRUE(writePicture(options.picture, spoilt));
    const Done done = pose(options, report);
    ASSERT_FALSE(done) << what;
    EXPECT_EQ(done.error()[0].where, options.picture);
    EXPECT_NE(done.error()[0].what.find(what), std::string::npos) << done.error()[0].message();
    EXPECT_EQ(done.error()[0].exitCode, EX_DATAERR);
    EXPECT_FALSE(std::filesystem::exists(options.output));
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
  EXPECT_FALSE(pose(options, report));
  EXPECT_FALSE(std::filesystem::exists(options.output));
}

}  // namespace
}  // namespace lens::gel_picture_commands_test

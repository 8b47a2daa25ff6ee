#include "daemon/calibrate/geometry_fit.h"
#include "lens/commands.h"
#include "lens/first_pose.h"
#include "lens/picture_file.h"
#include "sensor/gel_file.h"
#include "tests/support/seed.h"
#include "tests/unit/lens/workplace.h"
#include "twin/renderer.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cstdio>
#include <limits>
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

  void writeGelFile(double aspect);
  RestMarkers noisyMarkers(double noise_px);
  void tellApart(int trials);

  std::mt19937 generator{tractiond::test::seed()};
  sensor::Sensor truth;
  double printed_px = 0.0;  ///< deviation of each marker from its place in the pattern
  Eigen::Matrix2Xd places;  ///< px
  PoseOptions options;
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

/// Writes a gel file of the camera's true lens, and a pose that is not its own.
void GelPictureCommands::writeGelFile(double aspect) {
  sensor::Sensor file = truth;
  file.camera.position = Eigen::Vector3d(0, 0, 157e-3) + within(kOff);
  file.camera.rotation = within(kTurned);
  file.camera.aspect = aspect;
  write(options.gel, sensor::gelText(file));
}

TEST_F(GelPictureCommands, PoseIsFoundWhereTheScalesDiffer) {
  for (const double aspect : {1.035, 0.9}) {
    truth.camera.aspect = aspect;
    truth.camera.position = Eigen::Vector3d(0, 0, 165e-3) + within(2e-3);
    truth.camera.rotation = within(0.01);
    writeGelFile(aspect);
    ASSERT_TRUE(writePicture(options.picture, photograph()));
    const Done done = pose(options);
    ASSERT_TRUE(done) << done.error()[0].message();
    const auto found = sensor::loadGel(options.output);
    ASSERT_TRUE(found) << found.error().what;
    EXPECT_EQ(found->camera.aspect, aspect);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(found->camera.position[i], truth.camera.position[i], 5 * found->uncertainty.position[i]);
      EXPECT_NEAR(found->camera.rotation[i], truth.camera.rotation[i], 5 * found->uncertainty.rotation[i]);
    }
  }
}

TEST_F(GelPictureCommands, AnotherScaleIsNamedWithTheValueToWrite) {
  for (const double aspect : {1.035, 0.965, 1.1}) {
    truth.camera.aspect = aspect;
    truth.camera.position = Eigen::Vector3d(0, 0, 165e-3) + within(2e-3);
    truth.camera.rotation = within(0.03);
    writeGelFile(1.0);
    ASSERT_TRUE(writePicture(options.picture, photograph()));
    const Done done = pose(options);
    ASSERT_FALSE(done);
    const tractiond::Error& error = done.error()[0];
    char share[60];
    std::snprintf(share, sizeof share, "along y it is %.1f %% %s than camera.aspect = 1",
                  100.0 * std::abs(aspect - 1.0), aspect > 1.0 ? "larger" : "smaller");
    EXPECT_NE(error.what.find("scale differs in x and y"), std::string::npos) << error.message();
    EXPECT_NE(error.what.find(share), std::string::npos) << error.message();
    const std::size_t at = error.remedy.find("aspect = ");
    ASSERT_NE(at, std::string::npos) << error.message();
    EXPECT_NEAR(std::stod(error.remedy.substr(at + 9)), aspect, 1e-3);
    EXPECT_FALSE(std::filesystem::exists(options.output));
    // With that value it is found.
    writeGelFile(std::stod(error.remedy.substr(at + 9)));
    const Done again = pose(options);
    EXPECT_TRUE(again) << again.error()[0].message();
    std::filesystem::remove(options.output);
  }
}

/// Places of all markers with noise, as a tracker finds them in one picture.
RestMarkers GelPictureCommands::noisyMarkers(double noise_px) {
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

/// Cameras that the file has wrong in all but the aspect: none is taken for one of another aspect, and those of another
/// aspect are told.
void GelPictureCommands::tellApart(int trials) {
  const sensor::Sensor paper = truth;
  sensor::Sensor dots = truth;  // fewer dots, in one layer, and more columns than rows
  dots.layers.resize(1);
  dots.layers[0].columns = 10;
  dots.layers[0].rows = 7;
  int told = 0, clear = 0, missed = 0;
  double worst = 0.0;
  for (int trial = 0; trial < trials; ++trial) {
    const sensor::Sensor file = trial % 2 == 0 ? paper : dots;
    truth = file;
    truth.camera.position = Eigen::Vector3d(0, 0, 165e-3) + within(20e-3);
    truth.camera.rotation = within(between(0, 0.3));  // up to 17 degrees about each axis
    truth.camera.focal_px *= between(0.8, 1.25);
    truth.camera.principal_px += Eigen::Vector2d(between(-20, 20), between(-20, 20));
    truth.camera.k1 = between(-0.2, 0.1);
    truth.camera.k2 = between(-0.1, 0.1);
    const double pitch = between(0.95, 1.05);
    for (sensor::MarkerLayer& layer : truth.layers) layer.pitch *= pitch;
    const double noise_px = between(0.005, 0.1);
    const auto same = otherAspect(file, noisyMarkers(noise_px));
    EXPECT_FALSE(same) << trial << ": " << same->what();
    const double aspect = between(0.9, 1.1);
    if (std::abs(aspect - 1.0) < 0.02) continue;
    truth.camera.aspect = aspect;
    const auto other = otherAspect(file, noisyMarkers(noise_px));
    // Seen at a slant, they may be those of another focal length as well: few dots in one plane soonest.
    const bool isClear =
        std::abs(aspect - 1.0) > 0.03 && truth.camera.rotation.head<2>().norm() < (file.layers.size() > 1 ? 0.1 : 0.05);
    clear += isClear ? 1 : 0;
    missed += isClear && !other ? 1 : 0;
    if (!other) continue;
    ++told;
    EXPECT_NEAR(other->aspect, aspect, 5 * other->deviation) << trial;
    worst = std::max(worst, std::abs(other->aspect - aspect) / other->deviation);
  }
  std::printf(
      "%d cameras, %d times another aspect was told, %d of %d clear ones missed: off by %.1f deviations at most\n",
      trials, told, missed, clear, worst);
  EXPECT_GT(clear, 0);
  EXPECT_LE(50 * missed, clear);
  truth = paper;
}

TEST_F(GelPictureCommands, TiltsAndOtherLensesAreNoOtherScale) {
  tellApart(12);
}

TEST_F(GelPictureCommands, TiltsAndOtherLensesAreNoOtherScaleInMany) {
  tellApart(300);
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

/// Few dots of one plane behind a lens with strong barrel distortion that the file knows nothing of. Their pitch in y
/// is not quite that in x, so that the fit has several minima; the start from the file's lens does not always lead into
/// the lowest.
class FewDots : public GelPictureCommands {
 protected:
  struct View {
    sensor::Sensor file;
    RestMarkers markers;
  };
  struct Reached {
    int first = 0, all = 0, cameras = 0;
  };

  View draw(int trial);
  Reached reach(int cameras);
};

FewDots::View FewDots::draw(int trial) {
  constexpr double kPitch = 2e-3, kDepth = 1e-3;
  View view;
  sensor::Sensor& file = view.file;
  file.gel.size = {25e-3, 22e-3, 4e-3};
  file.layers.resize(1);
  sensor::MarkerLayer& layer = file.layers[0];
  layer.colour = sensor::Colour::kGrey;
  layer.columns = 10;
  layer.rows = trial % 2 == 0 ? 8 : 7;
  layer.pitch = kPitch;
  layer.depth = kDepth;
  layer.centre.setZero();
  file.uncertainty.principal_px = 20.0;
  sensor::Camera& camera = file.camera;
  camera.width = 320;
  camera.height = 240;
  camera.focal_px = between(0.7, 2.0) * camera.width;
  camera.principal_px = {159.5, 119.5};
  const double distance = camera.focal_px * kPitch / between(30, 33);
  camera.position = {0, 0, kDepth + distance};
  truth = file;
  sensor::Camera& seen = truth.camera;
  seen.aspect = between(0.98, 1.02);
  seen.principal_px += Eigen::Vector2d(between(-20, 20), between(-20, 20));
  seen.rotation = {between(-0.05, 0.05), between(-0.05, 0.05), between(-0.05, 0.05)};
  seen.position += Eigen::Vector3d(between(-1e-3, 1e-3), between(-1e-3, 1e-3), 0.0);
  const double corner2 = (0.25 * 320 * 320 + 0.25 * 240 * 240) / (seen.focal_px * seen.focal_px);
  seen.k1 = -between(0.15, 0.3) / corner2;
  view.markers = noisyMarkers(0.1);
  return view;
}

/// How many cameras' least residual is found, from the file's lens alone and from all starts. The least one is that of
/// either or of the start from the truth.
FewDots::Reached FewDots::reach(int cameras) {
  Reached reached;
  reached.cameras = cameras;
  FirstPoseOptions alone;
  alone.distortions.clear();
  alone.tilt = 0.0;
  for (int trial = 0; trial < cameras; ++trial) {
    const View view = draw(trial);
    const auto first = firstPose(view.file, view.markers, alone), found = firstPose(view.file, view.markers);
    const auto again = firstPose(view.file, view.markers);
    EXPECT_EQ(found.residual_px, again.residual_px);
    EXPECT_EQ(found.camera.position, again.camera.position);
    const auto best =
        tractiond::calibrate::fitGeometryFrom(truth.camera, view.file, view.markers.place_px, view.markers.present);
    constexpr auto kConverged = tractiond::calibrate::Geometry::Outcome::kConverged;
    const auto residual = [](const tractiond::calibrate::Geometry& fit) {
      return fit.outcome == kConverged ? fit.residual_px : std::numeric_limits<double>::infinity();
    };
    const double least = std::min({residual(first), residual(found), residual(best)});
    reached.first += residual(first) < 1.03 * least ? 1 : 0;
    reached.all += residual(found) < 1.03 * least ? 1 : 0;
  }
  std::printf("%d cameras: the least residual is found for %d from the file's lens alone, for %d from all starts\n",
              cameras, reached.first, reached.all);
  return reached;
}

TEST_F(FewDots, OneOfSeveralStartsLeadsToTheLeastResidual) {
  const Reached reached = reach(40);
  EXPECT_LT(reached.first, reached.cameras);  // else these cameras show nothing
  EXPECT_EQ(reached.all, reached.cameras);
}

TEST_F(FewDots, OneOfSeveralStartsLeadsToTheLeastResidualInMany) {
  const Reached reached = reach(300);
  EXPECT_LT(reached.first, reached.cameras);
  EXPECT_GE(100 * reached.all, 99 * reached.cameras);
}

/// No lens and no pose moves each marker another way.
TEST_F(GelPictureCommands, APoseThatFitsBadlyIsWrittenIfAskedFor) {
  truth.camera.position = {0, 0, 165e-3};
  printed_px = 1.0;
  ASSERT_TRUE(writePicture(options.picture, photograph()));
  write(options.gel, sensor::gelText(truth));
  const Done refused = pose(options);
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
  for (const double accepted_px : {2.0, offered_px}) {
    options.acceptResidual_px = accepted_px;
    testing::internal::CaptureStdout();
    const Done done = pose(options);
    const std::string printed = testing::internal::GetCapturedStdout();
    ASSERT_TRUE(done) << done.error()[0].message();
    EXPECT_NE(printed.find("warning: "), std::string::npos) << printed;
    const auto found = sensor::loadGel(options.output);
    ASSERT_TRUE(found) << found.error().what;
    EXPECT_LT((found->camera.position - truth.camera.position).norm(), 5e-3);
    std::filesystem::remove(options.output);
  }
  options.acceptResidual_px = 0.9 * left_px;
  EXPECT_FALSE(pose(options));
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
  ASSERT_TRUE(found) << found.error().what;
  EXPECT_EQ(found->count(), truth.markerCount());
  for (Eigen::Index i = 0; i < places.size(); ++i) {
    EXPECT_NEAR(found->place_px[static_cast<std::size_t>(i)], places.data()[i], 0.3);
  }
  // Two layers that only colours tell apart cannot be found in it.
  truth.layers = sensor::paperLayers();
  EXPECT_FALSE(findMarkers(picture, truth));
}

TEST_F(GelPictureCommands, FewerMarkersThanAPoseNeedsAreCounted) {
  truth.layers.resize(1);
  truth.layers[0].columns = truth.layers[0].rows = 7;
  write(options.gel, sensor::gelText(truth));
  ASSERT_TRUE(writePicture(options.picture, photograph()));
  const Done done = pose(options);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error()[0].what, "shows too few markers for a pose: 49");
}

TEST_F(GelPictureCommands, WhatShowsNoGelIsRefused) {
  write(options.gel, sensor::gelText(truth));
  cv::Mat picture = photograph();
  const auto refuse = [&](const cv::Mat& spoilt, const std::string& what) {
    ASSERT_TRUE(writePicture(options.picture, spoilt));
    for (const bool isPose : {true, false}) {
      const Done done = isPose ? pose(options) : mark(options);
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

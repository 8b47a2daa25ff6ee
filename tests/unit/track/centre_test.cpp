// Centres against the exact truth of the renderer.
#include "daemon/track/appearance.h"
#include "tests/unit/track/scene.h"

#include <gtest/gtest.h>

#include <cstdio>

namespace tractiond::track::centre_test {
namespace {

constexpr int kFrames = 150;
constexpr int kBins = 8;  // of a pixel and direction

/// Errors of the centres of all markers in many frames, each marker at its own place between the pixels.
struct Errors {
  double rms_px = 0.0;
  double bias_px = 0.0;        ///< mean, the larger of the two coordinates
  double systematic_px = 0.0;  ///< rms over places between the pixels of the mean there, per coordinate
  double ratio = 0.0;          ///< squared errors over what the variances promise
  double amplitude = 0.0;
  int lost = 0;
};

Errors measure(const twin::Optics& optics, twin::Format format) {
  Scene scene(optics, format);
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> place(-1.0, 1.0);
  for (Eigen::Index i = 0; i < scene.now.cols(); ++i) {
    scene.now.col(i) += Eigen::Vector2d(place(generator), place(generator));
  }
  Tracking tracking(scene);
  EXPECT_TRUE(tracking.start(scene));
  RestPose pose;
  EXPECT_TRUE(tracking.tracker.takeRestPose(pose));

  Errors errors;
  Eigen::Matrix2Xd sum = Eigen::Matrix2Xd::Zero(2, scene.now.cols());
  double square = 0.0, promised = 0.0;
  int count = 0;
  for (int frame = 0; frame < kFrames; ++frame) {
    tracking(scene.shoot());
    for (int i = 0; i < scene.markers(); ++i) {
      if (!tracking.field.valid[i]) {
        ++errors.lost;
        continue;
      }
      const Eigen::Vector2d centre(pose.position_px[2 * i] + tracking.field.displacement_px[2 * i],
                                   pose.position_px[2 * i + 1] + tracking.field.displacement_px[2 * i + 1]);
      const Eigen::Vector2d error = centre - scene.now.col(i);
      sum.col(i) += error;
      square += error.squaredNorm();
      promised += 2.0 * tracking.field.variance_px2[i];
      ++count;
    }
  }
  const Eigen::Vector2d mean = sum.rowwise().sum() / count;
  std::vector<Eigen::Vector2d> bin(kBins * kBins, Eigen::Vector2d::Zero());
  std::vector<int> filled(kBins * kBins, 0);
  for (int i = 0; i < scene.markers(); ++i) {
    const Eigen::Vector2d now = scene.now.col(i);
    const int period = twin::isBayer(format) ? 2 : 1;
    const auto index = [&](double x) { return static_cast<int>(std::floor(x / period * kBins)) % kBins; };
    bin[index(now.y()) * kBins + index(now.x())] += sum.col(i) / kFrames;
    ++filled[index(now.y()) * kBins + index(now.x())];
  }
  for (std::size_t i = 0; i < bin.size(); ++i) {
    if (filled[i] > 0) errors.systematic_px += bin[i].squaredNorm() / filled[i] / filled[i];
  }
  errors.systematic_px = std::sqrt(errors.systematic_px / (2.0 * kBins * kBins));
  errors.rms_px = std::sqrt(square / (2.0 * count));
  errors.bias_px = mean.lpNorm<Eigen::Infinity>();
  // A frame's error and the promised variance both are relative to the rest pose: take its share out.
  errors.ratio = square / (promised / (1.0 + 1.0 / 30.0));
  for (const float amplitude : pose.amplitude) errors.amplitude += double{amplitude} / scene.markers();
  return errors;
}

void print(const char* name, const Errors& errors) {
  std::printf("%-28s rms %.4f px, systematic %.4f px, bias %.4f px, squared / promised %.3f, lost %d\n", name,
              errors.rms_px, errors.systematic_px, errors.bias_px, errors.ratio, errors.lost);
}

TEST(Centre, IsWithinTheFiguresAndItsVarianceIsTrue) {
  twin::Optics uneven;
  uneven.lightSlope = {0.3, -0.3};
  struct Case {
    const char* name;
    twin::Optics optics;
    twin::Format format;
    double rms_px, systematic_px;
  };
  for (const Case& c : {Case{"RGB8", {}, twin::Format::kRgb8, 0.025, 0.005},
                        {"RGB8, light +-30 %", uneven, twin::Format::kRgb8, 0.025, 0.005},
                        {"BayerRG8", {}, twin::Format::kBayerRG8, 0.05, 0.01}}) {
    SCOPED_TRACE(c.name);
    const Errors errors = measure(c.optics, c.format);
    print(c.name, errors);
    EXPECT_LE(errors.rms_px, c.rms_px);
    EXPECT_LE(errors.systematic_px, c.systematic_px);
    EXPECT_LE(errors.bias_px, 0.005);
    EXPECT_NEAR(errors.ratio, 1.0, 0.15);
    EXPECT_NEAR(errors.amplitude, 100.0, 2.0);
    EXPECT_EQ(errors.lost, 0);
  }
}

TEST(Centre, EveryFormatPutsTheSameMarkerAtTheSamePlace) {
  for (const auto format : {twin::Format::kRgb8, twin::Format::kBgr8, twin::Format::kBayerRG8, twin::Format::kBayerGR8,
                            twin::Format::kBayerGB8, twin::Format::kBayerBG8}) {
    Scene scene({}, format);
    Tracking tracking(scene);
    ASSERT_TRUE(tracking.start(scene));
    RestPose pose;
    ASSERT_TRUE(tracking.tracker.takeRestPose(pose));
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (int i = 0; i < scene.markers(); ++i) {
      ASSERT_TRUE(pose.present[i]);
      const Eigen::Vector2d error =
          Eigen::Vector2d(pose.position_px[2 * i], pose.position_px[2 * i + 1]) - scene.rest.col(i);
      EXPECT_LT(error.norm(), 0.06);
      mean += error / scene.markers();
    }
    EXPECT_LT(mean.norm(), 0.003) << static_cast<int>(format);
  }
}

TEST(Centre, WindowsThatLeaveThePictureFindNothing) {
  Scene scene;
  const Frame& frame = scene.shoot();
  const Plane plane = planeOf(frame, sensor::Colour::kBlue);
  const MarkerTemplate marker(1.9, 0.85);
  for (const float u :
       {-1e9F, -1.0F, 0.0F, 2.0F, 634.0F, 639.0F, 700.0F, 1e9F, std::numeric_limits<float>::quiet_NaN()}) {
    for (const float v : {-5.0F, 0.0F, 240.0F, 476.0F, 1e30F}) {
      const Guess guess{u, v, 0.0F, true};
      Centre centre;
      fitCentres(plane, marker, {0.2F, 0.2F}, {&guess, 1}, {&centre, 1});
      EXPECT_FALSE(centre.found) << u << ' ' << v;
    }
  }
}

TEST(Centre, AMarkerIsCaughtFromItsOwnRadiusAway) {
  twin::Optics optics;
  optics.readNoise = 0.5;
  Scene scene(optics);
  const Frame& frame = scene.shoot();
  const Plane plane = planeOf(frame, sensor::Colour::kBlue);
  const MarkerTemplate marker(1.9, 0.85);
  const Eigen::Vector2d place = scene.rest.col(300);
  for (int direction = 0; direction < 16; ++direction) {
    const double angle = 0.125 * 3.14159265 * direction;
    const Guess guess{static_cast<float>(place.x() + 1.9 * std::cos(angle)),
                      static_cast<float>(place.y() + 1.9 * std::sin(angle)), 20.0F, false};
    Centre centre;
    fitCentres(plane, marker, {}, {&guess, 1}, {&centre, 1});
    ASSERT_TRUE(centre.found) << direction;
    EXPECT_NEAR(centre.u, place.x(), 0.02);
    EXPECT_NEAR(centre.v, place.y(), 0.02);
  }
}

TEST(Appearance, BlurAndCrossTalkAreFoundAgain) {
  for (const double blur : {0.6, 0.8, 1.2}) {
    twin::Optics optics;
    optics.blur_px = blur;
    optics.crossTalk = 0.25;
    Scene scene(optics);
    const Frame& frame = scene.shoot();
    const Plane blue = planeOf(frame, sensor::Colour::kBlue), red = planeOf(frame, sensor::Colour::kRed);
    std::vector<Guess> places;
    for (int i = 0; i < 300; ++i) {
      places.push_back({static_cast<float>(scene.rest(0, i)), static_cast<float>(scene.rest(1, i)), 20.0F, false});
    }
    const double radius_px = 0.5 * 0.6e-3 * 960.0 / 0.151;
    const MarkerTemplate marker = fittingTemplate(blue, radius_px, {}, places);
    EXPECT_NEAR(crossTalkInto(blue, red, marker, places), 0.25, 0.01);
    // The pixel's own width adds 1/12 px^2 to the blur's variance.
    const MarkerTemplate expected(radius_px, std::sqrt(blur * blur + 1.0 / 12.0));
    for (const double r : {0.0, 1.0, 2.0, 3.0}) EXPECT_NEAR(marker.at(r), expected.at(r), 0.02) << blur << ' ' << r;
  }
}

}  // namespace
}  // namespace tractiond::track::centre_test

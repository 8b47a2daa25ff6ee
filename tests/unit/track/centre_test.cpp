// Centres against the exact truth of the renderer.
#include "daemon/track/appearance.h"
#include "tests/unit/track/scene.h"

#include <Eigen/Dense>
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

TEST(Centre, Rgb8IsWithinTheFiguresAndItsVarianceIsTrue) {
  const Errors errors = measure({}, twin::Format::kRgb8);
  print("RGB8", errors);
  EXPECT_LE(errors.rms_px, 0.025);
  EXPECT_LE(errors.systematic_px, 0.005);
  EXPECT_LE(errors.bias_px, 0.005);
  EXPECT_NEAR(errors.ratio, 1.0, 0.15);
  EXPECT_NEAR(errors.amplitude, 100.0, 2.0);
  EXPECT_EQ(errors.lost, 0);
}

TEST(Centre, UnevenLightMovesNoCentre) {
  twin::Optics optics;
  optics.lightSlope = {0.3, -0.3};
  const Errors errors = measure(optics, twin::Format::kRgb8);
  print("RGB8, light +-30 %", errors);
  EXPECT_LE(errors.rms_px, 0.025);
  EXPECT_LE(errors.systematic_px, 0.005);
  EXPECT_LE(errors.bias_px, 0.005);
  EXPECT_NEAR(errors.ratio, 1.0, 0.15);
  EXPECT_EQ(errors.lost, 0);
}

TEST(Centre, BayerIsPrinted) {
  const Errors errors = measure({}, twin::Format::kBayerRG8);
  print("BayerRG8", errors);
  EXPECT_LE(errors.rms_px, 0.05);
  EXPECT_LE(errors.systematic_px, 0.01);
  EXPECT_NEAR(errors.ratio, 1.0, 0.15);
  EXPECT_EQ(errors.lost, 0);
}

TEST(Centre, VarianceIsTrueForOtherLightNoiseAndLens) {
  struct Case {
    const char* name;
    double contrast, blur, crossTalk, read, shot;
  };
  for (const Case& c :
       {Case{"contrast 40", 40.0, 0.8, 0.2, 2.0, 0.0}, Case{"noise 4", 100.0, 0.8, 0.2, 4.0, 0.0},
        Case{"shot noise", 150.0, 0.8, 0.2, 1.0, 0.1}, Case{"sharp", 100.0, 0.5, 0.2, 2.0, 0.0},
        Case{"blurred", 100.0, 1.4, 0.2, 2.0, 0.0}, Case{"cross-talk 40 %", 100.0, 0.8, 0.4, 2.0, 0.0}}) {
    twin::Optics optics;
    optics.contrast = c.contrast;
    optics.blur_px = c.blur;
    optics.crossTalk = c.crossTalk;
    optics.readNoise = c.read;
    optics.shotNoise = c.shot;
    const Errors errors = measure(optics, twin::Format::kRgb8);
    print(c.name, errors);
    EXPECT_NEAR(errors.ratio, 1.0, 0.15) << c.name;
    EXPECT_EQ(errors.lost, 0) << c.name;
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

/// The window's sums, plainly.
Centre slowFit(const Plane& plane, const MarkerTemplate& marker, double u, double v) {
  const double x = (u - plane.u0) / plane.scale, y = (v - plane.v0) / plane.scale;
  const int left = static_cast<int>(x) - marker.half() + 1, top = static_cast<int>(y) - marker.half() + 1;
  const int size = 2 * marker.half();
  Eigen::MatrixXd basis(size * size, 4);
  Eigen::VectorXd samples(size * size);
  for (int i = 0; i < size * size; ++i) {
    const int column = left + i % size, row = top + i / size;
    samples(i) = plane.first[row * plane.stride + column * plane.step];
    const auto at = [&](double du, double dv) { return marker.at(std::hypot(column - x - du, row - y - dv)); };
    constexpr double kStep = 1e-3;
    basis.row(i) << 1.0, at(0, 0), (at(kStep, 0) - at(-kStep, 0)) / (2 * kStep),
        (at(0, kStep) - at(0, -kStep)) / (2 * kStep);
  }
  const Eigen::VectorXd fit = basis.householderQr().solve(samples);
  Centre centre;
  centre.amplitude = static_cast<float>(fit(1));
  centre.u = static_cast<float>(u + plane.scale * fit(2) / fit(1));
  centre.v = static_cast<float>(v + plane.scale * fit(3) / fit(1));
  // What blur and a slope of the surroundings would explain is no misfit.
  Eigen::MatrixXd all(size * size, 7);
  all.leftCols<4>() = basis;
  for (int i = 0; i < size * size; ++i) {
    const double across = left + i % size - x, down = top + i / size - y;
    constexpr double kStep = 0.05;
    const auto at = [&](double du, double dv) { return marker.at(std::hypot(across - du, down - dv)); };
    const double laplacian = at(kStep, 0) + at(-kStep, 0) + at(0, kStep) + at(0, -kStep) - 4.0 * at(0, 0);
    all.row(i).tail<3>() << laplacian / (kStep * kStep), across, down;
  }
  const Eigen::VectorXd full = all.householderQr().solve(samples);
  centre.misfit = static_cast<float>((samples - all * full).squaredNorm() / (size * size - 7));
  centre.slopeU = static_cast<float>(full(5) / plane.scale);
  centre.slopeV = static_cast<float>(full(6) / plane.scale);
  const Eigen::MatrixXd covariance = (basis.transpose() * basis).inverse();
  centre.variance =
      static_cast<float>(plane.scale * plane.scale * 0.5 * (covariance(2, 2) + covariance(3, 3)) / (fit(1) * fit(1)));
  return centre;
}

TEST(Centre, TablesAgreeWithPlainLeastSquares) {
  for (const double diameter : {0.6e-3, 1.0e-3, 1.4e-3}) {
    for (const auto format : {twin::Format::kRgb8, twin::Format::kBayerGB8}) {
      sensor::Sensor sensor;
      for (auto& layer : sensor.layers) layer.diameter = diameter;
      twin::Optics optics;
      optics.crossTalk = 0.0;
      Scene scene(optics, format, sensor);
      const Frame& frame = scene.shoot();
      const Plane plane = planeOf(frame, sensor::Colour::kRed);
      const double radius_px = 0.5 * diameter * 960.0 / 0.149;
      const MarkerTemplate marker(radius_px / plane.scale, 0.85 / plane.scale);
      int compared = 0;
      for (int i = sensor.layers[0].count(); i < scene.markers(); i += 7) {
        const Eigen::Vector2d place = scene.rest.col(i);
        // At the tables' own phase: what remains is rounding.
        const auto snap = [&](double x, double origin) {
          return origin + plane.scale * std::round((x - origin) / plane.scale * MarkerTemplate::kPhases) /
                              MarkerTemplate::kPhases;
        };
        const double u = snap(place.x(), plane.u0), v = snap(place.y(), plane.v0);
        const Guess guess{static_cast<float>(u), static_cast<float>(v), 10.0F, false};
        Centre fast;
        fitCentres(plane, marker, {}, {&guess, 1}, {&fast, 1});
        if (!fast.found) continue;
        const Centre slow = slowFit(plane, marker, u, v);
        if (std::hypot(slow.u - u, slow.v - v) > 0.06 * plane.scale) continue;  // the fast one may step again
        EXPECT_NEAR(fast.u, slow.u, 2e-3);
        EXPECT_NEAR(fast.v, slow.v, 2e-3);
        EXPECT_NEAR(fast.amplitude, slow.amplitude, 0.05);
        EXPECT_NEAR(fast.misfit, slow.misfit, 0.02 * slow.misfit + 0.05);
        EXPECT_NEAR(fast.variance, slow.variance, 0.01F * slow.variance);
        EXPECT_NEAR(fast.slopeU, slow.slopeU, 0.02);
        EXPECT_NEAR(fast.slopeV, slow.slopeV, 0.02);
        ++compared;
      }
      EXPECT_GT(compared, 30);
    }
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

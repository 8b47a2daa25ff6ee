// How near the centres come to what the picture allows, and whether their variances are true.
//
// The bound of a coordinate is 1 / sqrt(sum over pixels and channels of (dI/du)^2 / noise variance), I being the twin's
// own picture before its noise, differentiated by moving the markers. Errors are those of displacements, from a zero of
// 30 frames, at poses that the zero did not see; the column "centre" holds the centres themselves against the bound,
// without the error of the zero.
#include "tests/unit/track/information.h"
#include "tests/unit/track/scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

namespace tractiond::track::limit_test {
namespace {

constexpr int kPoses = 8, kFramesPerPose = 12, kZeroFrames = 30;

struct Condition {
  const char* name;
  twin::Optics atRest = {};
  twin::Optics now = {};
  twin::Format format = twin::Format::kRgb8;
  double brightnessFrom = 1.0, brightnessTo = 1.0;  ///< of the LED, from the first pose to the last
  double press_px = 4.0;                            ///< at the middle of the bump
  double layerOffset_px = 0.0;                      ///< red moves further than blue by up to this
  sensor::Sensor sensor = {};
  double most = 0.0;  ///< of the bound, for a centre; 0: only printed
};

struct Figures {
  double rms_px = 0.0, bound_px = 0.0, systematic_px = 0.0;
  double centre_px = 0.0;  ///< rms of the centres themselves, without the zero's own error
  double chi2 = 0.0;       ///< mean of squared error over variance, per coordinate
  double tails = 0.0;      ///< share of errors above three deviations
  double largest = 0.0;    ///< deviations
  double valid = 0.0;      ///< share of the markers
};

Figures measure(const Condition& c) {
  Scene scene(c.atRest, c.format, c.sensor);
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> random(-1.0, 1.0);
  for (Eigen::Index i = 0; i < scene.rest.cols(); ++i) {
    scene.rest.col(i) += Eigen::Vector2d(random(generator), random(generator));
  }
  scene.now = scene.rest;
  Tracking tracking(scene, {.zeroFrames = kZeroFrames});
  RestPose zero;
  EXPECT_TRUE(tracking.start(scene) && tracking.tracker.takeRestPose(zero)) << c.name;
  scene.change(c.now);

  Figures figures;
  double square = 0.0, centreSquare = 0.0, bound = 0.0, within = 0.0, ofMeans = 0.0, chi2 = 0.0;
  int count = 0, means = 0, tails = 0;
  for (int pose = 0; pose < kPoses; ++pose) {
    const double share = pose / (kPoses - 1.0);
    const double brightness = c.brightnessFrom + share * (c.brightnessTo - c.brightnessFrom);
    Bump bump;
    bump.centre = {320.0 + 150.0 * random(generator), 240.0 + 100.0 * random(generator)};
    bump.width_px = 60.0;
    const double angle = 3.14159 * random(generator);
    const Eigen::Vector2d peak = c.press_px * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    const Eigen::Vector2d whole(0.5 * random(generator), 0.5 * random(generator));
    const Eigen::Vector2d offset = share * c.layerOffset_px * Eigen::Vector2d(-0.7071, 0.7071);
    const auto go = [&](double part) {
      bump.peak_px = part * peak;
      scene.displace(bump, 0.9);
      scene.now.colwise() += part * whole;
      if (scene.sensor.layers.size() > 1) scene.now.rightCols(scene.sensor.layers[1].count()).colwise() += offset;
    };
    // On the way, unseen by the statistics: off the last pose and on to this one, 7 px a frame at most.
    const Eigen::Matrix2Xd last = scene.now;
    go(0.0);
    const Eigen::Matrix2Xd unloaded = scene.now;
    for (int step = 1; step <= 4; ++step) {
      scene.now = last + 0.25 * step * (unloaded - last);
      tracking(scene.shoot(false, brightness));
    }
    for (int step = 1; step <= 4; ++step) {
      go(0.25 * step);
      tracking(scene.shoot(false, brightness));
    }
    const std::vector<double> bounds = boundsOf(scene, c.now, brightness);
    const auto markers = static_cast<std::size_t>(scene.markers());
    std::vector<Eigen::Vector2d> sum(markers, Eigen::Vector2d::Zero());
    std::vector<double> squares(markers, 0.0);
    std::vector<int> seen(markers, 0);
    for (int frame = 0; frame < kFramesPerPose; ++frame) {
      tracking(scene.shoot(false, brightness));
      for (int i = 0; i < scene.markers(); ++i) {
        if (!tracking.field.valid[i]) continue;
        const Eigen::Vector2d measured(tracking.field.displacement_px[2 * i],
                                       tracking.field.displacement_px[2 * i + 1]);
        const Eigen::Vector2d error = measured - (scene.now.col(i) - scene.rest.col(i));
        const double variance = tracking.field.variance_px2[i];
        const Eigen::Vector2d rest(zero.position_px[2 * i], zero.position_px[2 * i + 1]);
        centreSquare += (rest + measured - scene.now.col(i)).squaredNorm();
        sum[i] += error;
        squares[i] += error.squaredNorm();
        ++seen[i];
        square += error.squaredNorm();
        bound += 2.0 * bounds[i];
        chi2 += error.squaredNorm() / variance;
        for (const double e : error) {
          const double deviations = std::abs(e) / std::sqrt(variance);
          figures.largest = std::max(figures.largest, deviations);
          if (deviations > 3.0) ++tails;
        }
        ++count;
      }
    }
    for (std::size_t i = 0; i < markers; ++i) {
      if (seen[i] < kFramesPerPose) continue;
      ofMeans += sum[i].squaredNorm() / seen[i] / seen[i];
      within += (squares[i] - sum[i].squaredNorm() / seen[i]) / (seen[i] - 1);
      ++means;
    }
  }
  figures.rms_px = std::sqrt(square / (2.0 * count));
  figures.centre_px = std::sqrt(centreSquare / (2.0 * count));
  figures.bound_px = std::sqrt(bound / (2.0 * count));
  const double systematic = (ofMeans - within * (1.0 / kFramesPerPose + 1.0 / kZeroFrames)) / (2.0 * means);
  figures.systematic_px = std::copysign(std::sqrt(std::abs(systematic)), systematic);
  figures.chi2 = chi2 / (2.0 * count);
  figures.tails = tails / (2.0 * count);
  figures.valid = static_cast<double>(count) / (scene.markers() * kPoses * kFramesPerPose);
  return figures;
}

twin::Optics with(const std::function<void(twin::Optics&)>& change, twin::Optics optics = {}) {
  change(optics);
  return optics;
}

/// One layer of the paper's markers, behind a camera without colours.
sensor::Sensor oneLayer(bool darker) {
  sensor::Sensor sensor;
  sensor.layers.resize(1);
  sensor.layers[0].colour = sensor::Colour::kGrey;
  sensor.layers[0].darker = darker;
  return sensor;
}

std::vector<Condition> conditions() {
  const twin::Optics plain;
  const auto always = [](const char* name, const twin::Optics& optics) { return Condition{name, optics, optics}; };
  const auto shot = with([](auto& o) { o.readNoise = 1.0, o.shotNoise = 0.1; });
  const auto glare = with([](auto& o) {
    o.highlights = {{{250.0, 200.0}, 12.0, 400.0}, {{420.0, 300.0}, 30.0, 200.0}};
  });
  const auto dusty = with([](auto& o) {
    std::mt19937 generator(3);
    std::uniform_real_distribution<double> u(0.0, 640.0), v(0.0, 480.0), radius(0.4, 3.0);
    for (int i = 0; i < 300; ++i) o.dust.push_back({{u(generator), v(generator)}, radius(generator)});
  });
  const auto saturated = with([](auto& o) { o.contrast = 150.0, o.background = 120.0; });
  const auto bright = with([](auto& o) { o.contrast = 150.0, o.background = 80.0; });
  const auto uneven = with([](auto& o) { o.lightSlope = {0.3, -0.3}; });
  std::vector<Condition> all = {always("as stated", plain)};
  all.push_back({"Bayer", plain, plain, twin::Format::kBayerRG8});
  all.push_back(always("contrast 40", with([](auto& o) { o.contrast = 40.0; })));
  all.push_back(always("blur 0.5", with([](auto& o) { o.blur_px = 0.5; })));
  all.push_back(always("blur 1.4", with([](auto& o) { o.blur_px = 1.4; })));
  all.push_back({"blur 0.8, then 1.2", plain, with([](auto& o) { o.blur_px = 1.2; })});
  all.push_back({"blur 0.8, then 0.6", plain, with([](auto& o) { o.blur_px = 0.6; })});
  all.push_back(always("shot noise", shot));
  all.push_back(always("light +-30 %", uneven));
  all.push_back(always("light +-30 %, shot noise", with([](auto& o) { o.lightSlope = {0.3, -0.3}; }, shot)));
  all.push_back({"LED -20 to +20 %", plain, plain, twin::Format::kRgb8, 0.8, 1.2});
  all.push_back({"LED +20 %, shot noise", shot, shot, twin::Format::kRgb8, 1.2, 1.2});
  all.push_back({"LED -20 %, shot noise", shot, shot, twin::Format::kRgb8, 0.8, 0.8});
  all.push_back({"LED -20 to +20 %, shot, Bayer", shot, shot, twin::Format::kBayerRG8, 0.8, 1.2});
  all.push_back(always("highlights", glare));
  all.push_back({"highlights after the zero", plain, glare});
  all.push_back({"highlights after, Bayer", plain, glare, twin::Format::kBayerRG8});
  all.push_back(always("saturated", saturated));
  all.push_back({"LED to saturation", bright, bright, twin::Format::kRgb8, 1.0, 1.2});
  all.push_back(always("dust", dusty));
  all.push_back({"dust after the zero", plain, dusty});
  all.push_back({"dust after, Bayer", plain, dusty, twin::Format::kBayerRG8});
  all.push_back({"red passes before blue", plain, plain, twin::Format::kRgb8, 1.0, 1.0, 4.0, 8.0});
  all.push_back({"red before blue, Bayer", plain, plain, twin::Format::kBayerRG8, 1.0, 1.0, 4.0, 8.0});
  all.push_back({"pressed hard", plain, plain, twin::Format::kRgb8, 1.0, 1.0, 25.0});
  // The formats beyond 8 bits, and dark dots. `fine`: noise that 8 bits could not show.
  const auto light = with([](auto& o) { o.background = 150.0; });
  const auto fine = with([](auto& o) { o.readNoise = 0.5; });
  const auto add = [&](const char* name, twin::Format format, const twin::Optics& optics,
                       const sensor::Sensor& sensor = {}) {
    all.push_back({name, optics, optics, format, 1.0, 1.0, 4.0, 0.0, sensor, 1.1});
  };
  add("Mono12p", twin::Format::kMono12p, plain, oneLayer(false));
  add("BayerRG12", twin::Format::kBayerRG12, plain);
  add("RGB12", twin::Format::kRgb12, plain);
  add("Mono12p, noise 0.5", twin::Format::kMono12p, fine, oneLayer(false));
  add("dark dots, Mono8, one layer", twin::Format::kMono8, light, oneLayer(true));
  add("dark dots, Mono12Packed", twin::Format::kMono12Packed, light, oneLayer(true));
  return all;
}

// The systematic part holds what the means over eight frames carry along, about 0.003 px at a contrast of 100: it is
// part of the variance. So it is held against 0.005 px where noise is that of the stated picture, and in parts of the
// deviation elsewhere.
// A displacement is a centre less the zero's, and the zero is the mean of so many centres: its limit is wider by that.
TEST(Limit, CentresAreNearTheBoundAndVariancesAreTrue) {
  const double kZeroNoise = std::sqrt(1.0 + 1.0 / kZeroFrames);
  std::printf("the limit of a displacement is %.3f of a centre's: the zero is the mean of %d frames\n", kZeroNoise,
              kZeroFrames);
  std::printf("%-32s %8s %8s %6s %6s %6s %9s %6s %8s %8s %7s\n", "", "rms px", "bound", "displ.", "/limit", "centre",
              "system.", "chi2", "> 3 dev", "largest", "valid");
  for (const Condition& c : conditions()) {
    const Figures f = measure(c);
    std::printf("%-32s %8.4f %8.4f %6.3f %6.3f %6.3f %9.4f %6.3f %7.2f%% %8.1f %6.1f%%\n", c.name, f.rms_px, f.bound_px,
                f.rms_px / f.bound_px, f.rms_px / f.bound_px / kZeroNoise, f.centre_px / f.bound_px, f.systematic_px,
                f.chi2, 100.0 * f.tails, f.largest, 100.0 * f.valid);
    EXPECT_LE(f.rms_px, 1.3 * f.bound_px) << c.name;
    if (c.most > 0.0) {
      EXPECT_LE(f.centre_px, c.most * f.bound_px) << c.name;
      EXPECT_LE(f.rms_px, c.most * f.bound_px * kZeroNoise) << c.name;
    }
    EXPECT_LE(f.systematic_px, std::max(0.005, 0.4 * f.rms_px)) << c.name;
    EXPECT_GE(f.chi2, 0.8) << c.name;
    EXPECT_LE(f.chi2, 1.25) << c.name;
    EXPECT_LE(f.tails, 0.01) << c.name;
    EXPECT_GE(f.valid, 0.75) << c.name;
  }
}

}  // namespace
}  // namespace tractiond::track::limit_test

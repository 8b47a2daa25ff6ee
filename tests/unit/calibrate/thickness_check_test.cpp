#include "daemon/calibrate/thickness_check.h"
#include "sensor/elastic/loads.h"
#include "tests/unit/calibrate/markers.h"

#include <gtest/gtest.h>

#include <cstdio>

namespace tractiond::calibrate::thickness_check_test {
namespace {

constexpr sensor::PictureMotion kMotion{.shift_px = 0.005, .scale = 1e-5, .roll = 1e-5};
constexpr double kMeanNoise_px = 0.004;  // mean of a second's frames, and the zero's own

/// A gel, and what its file says of it.
struct Weighing {
  explicit Weighing(const sensor::Sensor& stated)
      : file(stated)
      , fit(stated)
      , check(stated, fit) {}

  /// `weight` [N] on a round spot of `truth`, read by the file.
  std::optional<ThicknessReading> operator()(const sensor::Sensor& truth, const Eigen::Vector2d& place, double weight,
                                             unsigned seed) const {
    const ContactFit world(truth);
    const Eigen::VectorXd moved =
        world.fields(truth.camera, {place.x(), place.y(), 3e-3}) * Eigen::Vector3d(0.0, 0.0, weight);
    const Seen seen(moved.reshaped(2, moved.size() / 2), kMeanNoise_px, seed);
    sensor::Sensor known = file;
    known.camera = truth.camera;
    known.pictureMotion = kMotion;
    const auto reading = fit(known, seen, seen.variance_px2);
    if (!reading) return std::nullopt;
    return check(known, seen, seen.variance_px2, *reading);
  }

  sensor::Sensor file;
  ContactFit fit;
  ThicknessCheck check;
};

const Eigen::Vector2d kOffTheCentre(12e-3, -8e-3);

TEST(ThicknessCheck, AQuarterMoreOrLessIsNoticedUnderOneWeightOffTheCentre) {
  const sensor::Sensor file;
  const Weighing weigh(file);
  for (const double share : {0.75, 1.25}) {
    sensor::Sensor truth = file;
    truth.gel.size.z() *= share;
    const auto found = weigh(truth, kOffTheCentre, 2.0, 1);
    ASSERT_TRUE(found);
    std::printf("%.0f mm in truth, 40 mm in the file: %.1f +- %.2f mm\n", 1e3 * truth.gel.size.z(),
                1e3 * found->thickness, 1e3 * found->deviation);
    EXPECT_TRUE(found->contradicts(file.gel.size.z()));
  }
}

TEST(ThicknessCheck, AGelAsUncertainAsItsFileSaysIsNoAlarm) {
  constexpr unsigned kSeed = 31;
  constexpr int kGels = 6;
  const sensor::Sensor file;
  const Weighing weigh(file);
  std::mt19937 random(kSeed);
  const auto normal = [&](double deviation) { return std::normal_distribution<double>(0.0, deviation)(random); };
  double squares = 0.0;
  for (int i = 0; i < kGels; ++i) {
    sensor::Sensor truth = file;
    truth.gel.size.z() += normal(file.uncertainty.thickness);
    truth.gel.poissonRatio = std::min(truth.gel.poissonRatio + normal(file.uncertainty.poissonRatio), 0.4995);
    truth.gel.youngsModulus *= 1.0 + normal(0.2);
    for (sensor::MarkerLayer& layer : truth.layers) layer.depth += normal(file.uncertainty.layerDepth);
    const auto found = weigh(truth, kOffTheCentre + Eigen::Vector2d(normal(5e-3), normal(5e-3)), 2.0, 100 + i);
    ASSERT_TRUE(found) << i;
    EXPECT_FALSE(found->contradicts(file.gel.size.z())) << i << ": " << 1e3 * found->thickness;
    squares += std::pow((found->thickness - file.gel.size.z()) / found->deviation, 2);
  }
  std::printf("seed %u: rms %.2f deviations over %d gels\n", kSeed, std::sqrt(squares / kGels), kGels);
  EXPECT_LT(squares, 12.59);  // of chi-squared with six degrees of freedom, 95 %
}

}  // namespace
}  // namespace tractiond::calibrate::thickness_check_test

// Torn and shifted pictures are noticed; loads, however fast, are not taken for them.
#include "sensor/elastic/half_space.h"
#include "sensor/elastic/loads.h"
#include "tests/unit/track/scene.h"

#include <gtest/gtest.h>

#include <cstdio>

namespace tractiond::track::tear_finder_test {
namespace {

constexpr double kYoung_Pa = 1.8e5;

/// Contacts that come, slide and go as fast as fingers can, and faster.
class Loads {
 public:
  explicit Loads(const sensor::Sensor& sensor)
      : points_(sensor::markerPositions(sensor.layers))
      , project_(sensor.camera, sensor.gel.size.z())
      , rest_(2, points_.cols()) {
    for (Eigen::Index i = 0; i < points_.cols(); ++i) rest_.col(i) = project_(points_.col(i));
  }

  /// The next frame's places. `farthest_px`: the displacement of the marker that moves most.
  Eigen::Matrix2Xd next(double& farthest_px) {
    if (--framesLeft_ < 0) {  // another contact
      framesLeft_ = 5 + static_cast<int>(40 * random());
      radius_ = 1e-3 + 9e-3 * random();
      position_ = 30e-3 * Eigen::Vector2d(2 * random() - 1, 2 * random() - 1);
      velocity_ = 4e-3 * random() * Eigen::Vector2d(2 * random() - 1, 2 * random() - 1);  // per frame: 0.24 m/s
      force_.setZero();
      // Up to 12 N, but no more pressure than 2.5 times Young's modulus: beyond, no gel stays whole, nor linear.
      wanted_ = 8.0 * random() * random() * Eigen::Vector3d(2 * random() - 1, 2 * random() - 1, 1.5 * random());
      const double most = 2.5 * kYoung_Pa * 3.1416 * radius_ * radius_;
      if (wanted_.norm() > most) wanted_ *= most / wanted_.norm();
      haste_ = random();
    }
    if (framesLeft_ < 3) wanted_.setZero();
    force_ += haste_ * (wanted_ - force_);
    position_ += velocity_;
    position_ = position_.cwiseMax(-36e-3).cwiseMin(36e-3);
    const auto patch = sensor::elastic::hertz(position_, radius_, force_, 2);
    Eigen::Matrix2Xd places(2, points_.cols());
    farthest_px = 0.0;
    for (Eigen::Index i = 0; i < points_.cols(); ++i) {
      Eigen::Vector3d moved = Eigen::Vector3d::Zero();
      for (Eigen::Index k = 0; k < patch.points.cols(); ++k) {
        moved += sensor::elastic::halfSpaceDisplacement(points_.col(i) - patch.points.col(k), kYoung_Pa, 0.49) *
                 patch.forces.col(k);
      }
      places.col(i) = project_(points_.col(i) + moved);
      farthest_px = std::max(farthest_px, (places.col(i) - rest_.col(i)).norm());
    }
    return places;
  }

 private:
  double random() { return uniform_(generator_); }

  sensor::Points points_;
  sensor::Projection project_;
  Eigen::Matrix2Xd rest_;
  std::mt19937 generator_{5};
  std::uniform_real_distribution<double> uniform_{0.0, 1.0};
  int framesLeft_ = 0;
  double radius_ = 0.0, haste_ = 0.0;
  Eigen::Vector2d position_, velocity_;
  Eigen::Vector3d force_, wanted_;
};

TEST(TearFinder, TakesNoLoadForATear) {
  // The displacements themselves, with the noise and the gaps of tracking.
  const sensor::Sensor sensor;
  Loads loads(sensor);
  const std::vector<Lattice> lattices = latticesOf(sensor);
  TearFinder finder(lattices);
  const Scene scene({}, twin::Format::kRgb8, sensor);
  std::mt19937 generator(1);
  std::normal_distribution<float> noise(0.0F, 0.0165F);
  std::bernoulli_distribution lost(0.05);
  const auto count = static_cast<std::size_t>(scene.markers());
  std::vector<Vector> displacement(count);
  std::vector<float> variance(count, 0.0165F * 0.0165F);
  std::vector<std::uint8_t> valid(count);
  constexpr int kFrames = 2000;
  int alarms = 0;
  double farthest = 0.0, fastest = 0.0;
  Eigen::Matrix2Xd before = scene.rest;
  for (int frame = 0; frame < kFrames; ++frame) {
    double now = 0.0;
    const Eigen::Matrix2Xd places = loads.next(now);
    farthest = std::max(farthest, now);
    fastest = std::max(fastest, (places - before).colwise().norm().maxCoeff());
    before = places;
    for (std::size_t i = 0; i < count; ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      const Eigen::Vector2f moved = (places.col(k) - scene.rest.col(k)).cast<float>();
      displacement[i] = {moved.x() + noise(generator), moved.y() + noise(generator)};
      valid[i] = lost(generator) ? 0 : 1;
    }
    if (finder.torn(displacement, variance, valid)) ++alarms;
  }
  std::printf("%d alarms in %d frames of loads, up to %.1f px far and %.1f px per frame\n", alarms, kFrames, farthest,
              fastest);
  EXPECT_EQ(alarms, 0);
}

TEST(Tear, ShiftedRowsAreNoticedAndTheNextFrameIsRight) {
  for (const auto format : {twin::Format::kRgb8, twin::Format::kBayerRG8}) {
    Scene scene({}, format);
    Started tracking(scene);
    for (const int px : {2, -10, 14, 40}) {
      for (const int row : {100, 240, 380}) {
        const Frame& frame = scene.shoot();
        scene.shift(row, px);
        tracking(frame);
        EXPECT_TRUE(tracking.field.flags & kTorn) << px << " px from row " << row;
        for (int i = 0; i < 2; ++i) {
          tracking(scene.shoot());
          EXPECT_FALSE(tracking.field.flags & kTorn) << px << " px from row " << row;
          const Comparison comparison = compare(scene, tracking.field);
          EXPECT_EQ(comparison.wrong, 0) << px << " px from row " << row;
          EXPECT_GE(comparison.valid, scene.markers() - 4) << px << " px from row " << row;
        }
      }
    }
  }
}

TEST(Tear, AShiftOfAnEighthOfAPixelIsNoticedMostlyAndOfAHalfAlways) {
  // Sub-pixel shifts are drawn as such.
  Scene scene;
  Started tracking(scene);
  constexpr int kTimes = 20;
  struct Case {
    double px;
    int least, most;
  };
  for (const auto& [px, least, most] : {Case{0.10, 0, 2}, {0.20, 14, kTimes}, {0.50, kTimes, kTimes}}) {
    int noticed = 0;
    for (int i = 0; i < kTimes; ++i) {
      Eigen::Matrix2Xd moved = scene.rest;
      moved.row(0).array() += px;
      const Frame& frame = scene.shoot();
      scene.tear(100 + 14 * i, moved);
      tracking(frame);
      if (tracking.field.flags & kTorn) ++noticed;
      for (int k = 0; k < 5; ++k) tracking(scene.shoot());  // an unnoticed one is what the next is compared with
      EXPECT_FALSE(tracking.field.flags & kTorn);
    }
    std::printf("shift of %.2f px: noticed %d of %d times\n", px, noticed, kTimes);
    EXPECT_GE(noticed, least) << px;
    EXPECT_LE(noticed, most) << px;
  }
}

TEST(Tear, MomentsMixedUpWhereTheGelMovesAreNoticed) {
  Scene scene;
  Started tracking(scene);
  struct Case {
    double perFrame, least;  ///< motion [px] and the share that is noticed
  };
  for (const auto& [perFrame, least] : {Case{0.5, 0.4}, {1.0, 0.7}, {3.0, 0.9}, {6.0, 1.0}}) {
    int noticed = 0, times = 0;
    for (int row = 195; row <= 285; row += 10) {
      Bump bump;
      for (int i = 0; i < 6; ++i) {
        bump.peak_px = {-0.3 * perFrame * i, perFrame * i};
        const Eigen::Matrix2Xd before = scene.now;
        scene.displace(bump, 0.9);
        const Frame& frame = scene.shoot();
        if (i == 3) scene.tear(row, before);
        tracking(frame);
        if (i == 3) {
          noticed += tracking.field.flags & kTorn ? 1 : 0;
          ++times;
        } else {
          EXPECT_EQ(compare(scene, tracking.field).wrong, 0);
        }
        EXPECT_FALSE(i < 3 && tracking.field.flags & kTorn);
      }
      scene.now = scene.rest;
      tracking(scene.shoot(true));
    }
    std::printf("lower part a frame older, %.1f px per frame: noticed %d of %d times\n", perFrame, noticed, times);
    EXPECT_GE(noticed, least * times) << perFrame;
  }
}

TEST(Tear, AStepThatStaysIsTakenForTheGels) {
  Scene scene;
  Started tracking(scene);
  int flagged = 0;
  for (int i = 0; i < 10; ++i) {
    const Frame& frame = scene.shoot();
    scene.shift(240, 3);
    tracking(frame);
    flagged += tracking.field.flags & kTorn ? 1 : 0;
  }
  EXPECT_EQ(flagged, 3);
}

TEST(Tear, NoZeroIsTakenFromTornPictures) {
  Scene scene;
  Started tracking(scene);
  tracking.tracker.requestZero();
  for (int i = 0; i < 36; ++i) {
    const Frame& frame = scene.shoot();
    if (i % 7 == 3) scene.shift(240, 3);
    tracking(frame);
  }
  EXPECT_EQ(tracking.tracker.zeroState(), ZeroState::kTaken);
  tracking(scene.shoot());
  const Comparison comparison = compare(scene, tracking.field);
  EXPECT_EQ(comparison.wrong, 0);
  EXPECT_LT(comparison.rms_px, 0.02);
}

}  // namespace
}  // namespace tractiond::track::tear_finder_test

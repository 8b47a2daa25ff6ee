// The first picture: what is known is the grid, not where it is.
#include "daemon/track/labelling.h"
#include "daemon/track/nominal.h"
#include "tests/unit/track/scene.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace tractiond::track::labelling_test {
namespace {

struct Move {
  const char* name;
  double u, v, degrees, scale;
};

void PrintTo(const Move& move, std::ostream* out) {
  *out << move.name;
}

class FirstPicture : public testing::TestWithParam<Move> {};

/// All labels of the rest pose are right, and all markers that are there have one.
void expectRightPose(const Scene& scene, Tracker& tracker, double share) {
  RestPose pose;
  ASSERT_TRUE(tracker.takeRestPose(pose));
  int there = 0, found = 0;
  for (int i = 0; i < scene.markers(); ++i) {
    const Eigen::Vector2d truth = scene.now.col(i);
    there += truth.allFinite() && truth.x() > 8 && truth.y() > 8 && truth.x() < 631 && truth.y() < 471;
    if (!pose.present[i]) continue;
    ++found;
    ASSERT_TRUE(truth.allFinite()) << i;
    const Eigen::Vector2d place(pose.position_px[2 * i], pose.position_px[2 * i + 1]);
    ASSERT_LT((place - truth).norm(), 0.2) << i;
  }
  EXPECT_GE(found, share * there);
}

void expectRightLabels(Scene& scene, double share) {
  Started tracking(scene);
  expectRightPose(scene, tracking.tracker, share);
}

TEST_P(FirstPicture, IsLabelledRightWithATenthOfTheMarkersMissing) {
  const Move move = GetParam();
  for (const auto format : {twin::Format::kRgb8, twin::Format::kBayerGR8}) {
    Scene scene({}, format);
    scene.remove(0.1, 7);
    const Eigen::Rotation2D<double> turn(move.degrees * 3.14159265358979 / 180.0);
    const Eigen::Vector2d middle(319.5, 239.5);
    for (Eigen::Index i = 0; i < scene.now.cols(); ++i) {
      scene.now.col(i) = middle + move.scale * (turn * (scene.rest.col(i) - middle)) + Eigen::Vector2d(move.u, move.v);
    }
    expectRightLabels(scene, 0.99);
  }
}

INSTANTIATE_TEST_SUITE_P(Moves, FirstPicture,
                         testing::Values(Move{"none", 0, 0, 0, 1}, Move{"leftAndUp", -14, -6, 0, 1},
                                         Move{"farRight", 40, 3, 0, 1}, Move{"farDown", 2, 25, 0, 1},
                                         Move{"turnedBack", -5, 2, -4, 1}, Move{"larger", 2, 2, 0, 1.03},
                                         Move{"all", 11, -4, 2.5, 0.96}),
                         [](const auto& move) { return std::string(move.param.name); });

TEST(Labelling, DustAndStrongUnevenLightDoNotConfuse) {
  twin::Optics optics;
  optics.lightSlope = {0.3, 0.2};
  Scene scene(optics);
  scene.remove(0.1, 11);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(10, 630), v(10, 470), size(0.8, 5.0);
  Tracking tracking(scene);
  std::vector<std::array<double, 3>> dust;
  for (int i = 0; i < 40; ++i) dust.push_back({u(random), v(random), size(random)});
  for (int i = 0; i < 40 && !(tracking.field.validCount > 0); ++i) {
    const Frame& frame = scene.shoot();
    for (std::size_t k = 0; k < dust.size(); ++k) scene.smear(dust[k][0], dust[k][1], dust[k][2], k % 2 ? 200 : 0);
    tracking(frame);
  }
  RestPose pose = tracking.takeZero();
  int found = 0;
  for (int i = 0; i < scene.markers(); ++i) {
    if (!pose.present[i]) continue;
    ++found;
    const bool dusty = std::any_of(dust.begin(), dust.end(), [&](const auto& speck) {
      return std::hypot(speck[0] - pose.position_px[2 * i], speck[1] - pose.position_px[2 * i + 1]) < speck[2] + 6.0;
    });
    const Eigen::Vector2d truth = scene.now.col(i);
    if (dusty && !truth.allFinite()) continue;
    ASSERT_TRUE(truth.allFinite());
    const double error = (Eigen::Vector2d(pose.position_px[2 * i], pose.position_px[2 * i + 1]) - truth).norm();
    EXPECT_LT(error, dusty ? 3.0 : 0.05) << i;
  }
  EXPECT_GE(found, 0.9 * 0.9 * scene.markers());
}

TEST(Labelling, AnEmptyOrForeignPictureIsRefused) {
  Scene scene;
  scene.now.setConstant(std::numeric_limits<double>::quiet_NaN());
  Tracking tracking(scene);
  EXPECT_FALSE(tracking.start(scene, 20));

  std::mt19937 random(2);
  std::uniform_real_distribution<double> u(0, 640), v(0, 480);
  for (Eigen::Index i = 0; i < scene.now.cols(); ++i) scene.now.col(i) = Eigen::Vector2d(u(random), v(random));
  EXPECT_FALSE(tracking.start(scene, 20));
}

/// Where rows are near to each other, a missing marker's neighbour in its column is no farther than one in its row.
TEST(Labelling, AMissingMarkerIsNotItsNeighbourInADenseColumn) {
  constexpr int kSide = 12;
  constexpr float kAcross_px = 40.0F, kDown_px = 15.0F;
  const Lattice lattice{0, kSide, kSide};
  std::vector<Vector> reference_px, place_px(static_cast<std::size_t>(lattice.count()));
  std::vector<Spot> spots;
  std::vector<std::uint8_t> there, labelled(place_px.size());
  std::mt19937 random(3);
  for (int i = 0; i < lattice.count(); ++i) {
    reference_px.push_back(
        {100.0F + kAcross_px * static_cast<float>(i % kSide), 100.0F + kDown_px * static_cast<float>(i / kSide)});
    there.push_back(random() % 10 == 0 ? 0 : 1);
    if (there.back() != 0) spots.push_back({reference_px.back().u, reference_px.back().v, 100.0F});
  }
  Labeller labeller({lattice}, 640, 480, 4 * lattice.count());
  const std::span<const Spot> all(spots);
  ASSERT_TRUE(labeller.label({&all, 1}, reference_px, {}, place_px, labelled));
  EXPECT_EQ(labelled, there);
  for (std::size_t i = 0; i < place_px.size(); ++i) {
    if (labelled[i] == 0) continue;
    EXPECT_EQ(place_px[i].v, reference_px[i].v) << i;
  }
}

TEST(Trackable, RefusesWhatCannotBeTracked) {
  EXPECT_TRUE(trackable({}));
  sensor::Sensor sensor;
  sensor.layers[1].colour = sensor.layers[0].colour;
  EXPECT_FALSE(trackable(sensor));
  sensor = {};
  sensor.layers[0].diameter = 2.9e-3;
  EXPECT_FALSE(trackable(sensor));
  sensor = {};
  sensor.layers[1].diameter = 0.1e-3;
  EXPECT_FALSE(trackable(sensor));
  sensor = {};
  sensor.layers[1].rows = 3;
  EXPECT_FALSE(trackable(sensor));
  sensor = {};
  for (sensor::MarkerLayer& layer : sensor.layers) layer.diameter = 0.5 * layer.pitch;
  EXPECT_TRUE(trackable(sensor));
  sensor.camera.aspect = 0.5;  // nearer to each other along a column than along a row
  EXPECT_FALSE(trackable(sensor));
  sensor = {};
  sensor.layers.clear();
  const auto refused = trackable(sensor);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().exitCode, EX_CONFIG);
}

}  // namespace
}  // namespace tractiond::track::labelling_test

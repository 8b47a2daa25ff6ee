// Pictures whose scale differs between x and y, and what is no other scale.
#include "lens/first_pose.h"
#include "lens/picture_file.h"
#include "tests/unit/lens/gel_picture_bench.h"

#include <algorithm>
#include <cstdio>

namespace lens::gel_picture_commands_test {

namespace {

TEST_F(GelPictureCommands, PoseIsFoundWhereTheScalesDiffer) {
  for (const double aspect : {1.035, 0.9}) {
    truth.camera.aspect = aspect;
    truth.camera.position = Eigen::Vector3d(0, 0, 165e-3) + within(2e-3);
    truth.camera.rotation = within(0.01);
    writeGelFile(aspect);
    ASSERT_TRUE(writePicture(options.picture, photograph()));
    expectPosed();
  }
}

TEST_F(GelPictureCommands, AnotherScaleIsNamedWithTheValueToWrite) {
  for (sensor::MarkerLayer& layer : truth.layers) layer.columns = layer.rows = 12;
  for (const double aspect : {1.07, 0.93}) {
    truth.camera.aspect = aspect;
    truth.camera.position = Eigen::Vector3d(0, 0, 165e-3) + within(2e-3);
    truth.camera.rotation = within(0.03);
    writeGelFile(1.0);
    ASSERT_TRUE(writePicture(options.picture, photograph()));
    const Done done = pose(options, report);
    ASSERT_FALSE(done);
    const tractiond::Error& error = done.error()[0];
    EXPECT_NE(error.what.find("scale differs in x and y"), std::string::npos) << error.message();
    const std::string share = aspect > 1.0 ? "% larger than camera.aspect = 1" : "% smaller than camera.aspect = 1";
    EXPECT_NE(error.what.find(share), std::string::npos) << error.message();
    const std::size_t at = error.remedy.find("aspect = ");
    ASSERT_NE(at, std::string::npos) << error.message();
    EXPECT_NEAR(std::stod(error.remedy.substr(at + 9)), aspect, 1e-3);
    EXPECT_FALSE(std::filesystem::exists(options.output));
  }
}

/// Cameras that the file has wrong in all but the aspect: none is taken for one of another aspect, and those of another
/// aspect are told.
TEST_F(GelPictureCommands, TiltsAndOtherLensesAreNoOtherScale) {
  constexpr int kTrials = 8;
  const sensor::Sensor paper = truth;
  sensor::Sensor dots = truth;  // fewer dots, in one layer, and more columns than rows
  dots.layers.resize(1);
  dots.layers[0].columns = 10;
  dots.layers[0].rows = 7;
  int told = 0, clear = 0, missed = 0;
  double worst = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
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
      kTrials, told, missed, clear, worst);
  EXPECT_GT(clear, 0);
  EXPECT_LE(50 * missed, clear);
  truth = paper;
}

}  // namespace
}  // namespace lens::gel_picture_commands_test

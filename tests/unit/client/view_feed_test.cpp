#include "client/viewer/places.h"
#include "client/viewer/surface.h"
#include "tests/support/deadline.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <thread>

namespace traction::view {
namespace {

/// Arrows are drawn from all of them: one that is no number would hide the others.
TEST(Places, AreNumbersWhereACurvedWindowHidesNodes) {
  Description description;
  description.nodes = {.columns = 6, .rows = 6, .pitch_m = 0.008, .centre_m = {}};
  description.camera.focal_px = 400.0;
  description.camera.position_m = {0.0, 0.0, 0.014};
  description.camera.gelIndex = 1.41;
  description.camera.surfaces = {{{0.0, 0.0, 0.01}, {0.006, 0.006, 0.006}, 1.5},
                                 {{0.0, 0.0, 0.01}, {0.0045, 0.0045, 0.0045}, 1.0}};
  const std::vector<float> places = nodePlaces_px(description);
  ASSERT_EQ(places.size(), 72U);
  for (const float place : places) EXPECT_TRUE(std::isfinite(place));
  EXPECT_NEAR(places[0], -400.0F * 20 / 14, 0.1F);              // hidden
  EXPECT_GT(std::abs(places[2 * 14] + 400.0F * 4 / 14), 1.0F);  // refracted
}

/// Returns a block of 30 x 30 x 10 mm with 6 x 6 nodes.
Description smallGel(double modulus_Pa) {
  Description description;
  description.gel = {.youngsModulus_Pa = modulus_Pa, .poissonRatio = 0.48, .size_m = {0.03, 0.03, 0.01}};
  description.nodes = {.columns = 6, .rows = 6, .pitch_m = 0.003, .centre_m = {}};
  return description;
}

/// Waits until the gel's own matrix is there. Returns the motion under 1 N into the gel at node 14 [mm].
Eigen::VectorXf motionOf(Surface& surface) {
  Field field;
  field.force_N.resize(36);
  field.force_N[14] = {0.0F, 0.0F, 1.0F};
  const Eigen::VectorXf* moved = nullptr;
  const bool isThere = tractiond::test::eventually([&] {
    std::this_thread::yield();
    moved = surface.displacement(field);
    return moved != nullptr && surface.share() == 1.0F;
  });
  return isThere ? *moved : Eigen::VectorXf();
}

TEST(Surface, IsComputedOnceForAGelOfAnyModulus) {
  const tractiond::test::TemporaryFolder folder;
  setenv("XDG_CACHE_HOME", folder.path().c_str(), 1);
  Eigen::VectorXf first;
  {
    Surface surface;
    surface.describe(smallGel(1e5));
    first = motionOf(surface);
  }
  ASSERT_EQ(first.size(), 108);
  EXPECT_GT(first[3 * 14 + 2], 1.5F * first[3 * 15 + 2]);  // where it is pressed
  const std::filesystem::path cache = folder.path() / "traction";
  const auto files = [&] { return std::distance(std::filesystem::directory_iterator(cache), {}); };
  ASSERT_EQ(files(), 1);
  const auto made = std::filesystem::last_write_time(*std::filesystem::directory_iterator(cache));
  Surface calibrated;
  calibrated.describe(smallGel(2e5));
  EXPECT_LT((motionOf(calibrated) - 0.5F * first).norm(), 1e-5F * first.norm());
  EXPECT_EQ(files(), 1);
  EXPECT_EQ(std::filesystem::last_write_time(*std::filesystem::directory_iterator(cache)), made);
}

}  // namespace
}  // namespace traction::view

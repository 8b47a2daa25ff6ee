#include "client/viewer/playing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace traction::view {
namespace {

using namespace std::chrono_literals;

TEST(Playing, TimeOfAMomentIsLimited) {
  constexpr std::uint64_t kSecond = 1'000'000'000;
  EXPECT_EQ(timeToPlay(3 * kSecond, 2.0), 1500ms);
  EXPECT_EQ(timeToPlay(0, 1e-300), 0s);
  for (const double speed : {1e-10, 5e-324, 0.0, -1.0, std::nan("")}) EXPECT_EQ(timeToPlay(kSecond, speed), 24h * 365);
  for (const double speed : {0.0, -0.0, -1.0, std::nan("")}) EXPECT_EQ(timeToPlay(0, speed), 24h * 365);
  EXPECT_EQ(timeToPlay(std::numeric_limits<std::uint64_t>::max(), 1.0), 24h * 365);
  EXPECT_EQ(timeToPlay(kSecond, std::numeric_limits<double>::infinity()), 0s);
}

}  // namespace
}  // namespace traction::view

#include "twin/creep.h"

#include <gtest/gtest.h>

#include <cmath>

namespace twin {
namespace {

sensor::Points one(double value) {
  return sensor::Points::Constant(3, 1, value);
}

TEST(Creep, ARampIsFollowedExactlyWhateverTheSteps) {
  constexpr double kTau = 2.0;
  for (const double step : {0.5, 0.1, 0.01}) {
    Creep creep({{.share = 0.3, .time_s = kTau}}, 1);
    const int steps = static_cast<int>(std::lround(4.0 / step));
    for (int i = 0; i <= steps; ++i) creep.advance(i * step, one(i * step));
    // dh/dt = (t - h) / tau: h = t - tau (1 - exp(-t / tau)).
    const double h = 4.0 - kTau * (1.0 - std::exp(-4.0 / kTau));
    EXPECT_NEAR(creep.now()(0, 0), 0.3 * h, 1e-12);
  }
}

}  // namespace
}  // namespace twin

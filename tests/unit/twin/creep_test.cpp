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

TEST(Creep, TermsAddUpAndGoBackAfterTheLoad) {
  Creep creep({{.share = 0.1, .time_s = 0.5}, {.share = 0.05, .time_s = 5.0}}, 1);
  creep.advance(0.0, one(0.0));
  creep.advance(1e-9, one(1.0));
  EXPECT_NEAR(creep.now()(2, 0), 0.0, 1e-8);
  for (int i = 1; i <= 1000; ++i) creep.advance(i * 0.1, one(1.0));
  EXPECT_NEAR(creep.now()(2, 0), 0.15, 1e-8);
  creep.advance(100.0 + 1e-9, one(0.0));
  creep.advance(105.0 + 1e-9, one(0.0));
  EXPECT_NEAR(creep.now()(2, 0), 0.1 * std::exp(-10.0) + 0.05 * std::exp(-1.0), 1e-6);
}

}  // namespace
}  // namespace twin

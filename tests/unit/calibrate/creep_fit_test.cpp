#include "daemon/calibrate/creep_fit.h"
#include "twin/creep.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tractiond::calibrate {
namespace {

/// Amounts by which a load displaces a gel that creeps as the twin's does: put on at 2 s, and taken away.
std::vector<LoadReading> readings(const std::vector<sensor::CreepTerm>& terms, double held_s, double released_s,
                                  double noise = 0.0, unsigned seed = 1) {
  constexpr double kInterval_s = 1.0 / 60, kOn_s = 2.0, kWay_s = 0.2;
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  twin::Creep creep(terms, 1);
  std::vector<LoadReading> all;
  for (double at_s = 0.0; at_s < kOn_s + held_s + released_s; at_s += kInterval_s) {
    const double on = std::clamp((at_s - kOn_s) / kWay_s, 0.0, 1.0);
    const double load = on - std::clamp((at_s - kOn_s - held_s) / kWay_s, 0.0, 1.0);
    sensor::Points elastic(3, 1);
    elastic << load, 0.0, 0.0;
    creep.advance(at_s, elastic);
    // It is noticed when half of it has gone.
    const LoadPhase phase = at_s < kOn_s                           ? LoadPhase::kUntouched
                            : at_s < kOn_s + held_s + 0.5 * kWay_s ? LoadPhase::kLoaded
                                                                   : LoadPhase::kReleased;
    all.push_back({.at_s = at_s,
                   .length_s = kInterval_s,
                   .amount = load + creep.now()(0, 0) + noise * normal(generator),
                   .phase = phase});
  }
  return all;
}

/// By how much terms grow until then.
double grown(const std::vector<sensor::CreepTerm>& terms, double time_s) {
  double sum = 0.0;
  for (const sensor::CreepTerm& term : terms) sum += -term.share * std::expm1(-time_s / term.time_s);
  return sum;
}

TEST(CreepFit, AGelThatCreepsAtOtherTimesIsFollowedAsLongAsTheLoadStayed) {
  const auto found =
      fitCreep(readings({{.share = 0.02, .time_s = 1.0}, {.share = 0.03, .time_s = 20.0}}, 60.0, 60.0), 60.0);
  ASSERT_TRUE(found);
  for (const double time_s : {0.5, 1.0, 3.0, 10.0, 60.0}) {
    const double is = -0.02 * std::expm1(-time_s) - 0.03 * std::expm1(-time_s / 20.0);
    EXPECT_NEAR(found->load * (1.0 + grown(found->terms, time_s)), 1.0 + is, 2e-3) << time_s << " s";
  }
  EXPECT_LT(found->error, 2e-3);
}

TEST(CreepFit, NoCreepIsFoundWhereThereIsNone) {
  const auto found = fitCreep(readings({}, 60.0, 60.0, 1e-3), 60.0);
  ASSERT_TRUE(found);
  for (const sensor::CreepTerm& term : found->terms) EXPECT_LT(term.share, 3.0 * term.deviation) << term.time_s;
  EXPECT_LT(grown(found->terms, 60.0), 1e-3);
}

TEST(CreepFit, WhatTheLoadWasTooShortForIsUncertain) {
  const auto found = fitCreep(readings({{.share = 0.03, .time_s = 20.0}}, 60.0, 60.0, 1e-3), 60.0);
  ASSERT_TRUE(found);
  sensor::Sensor sensor;
  sensor.creep = found->terms;
  const Eigen::MatrixXd covariance = sensor::creepCovariance(sensor.creep);
  const auto deviationAfter = [&](double time_s) {  // of what it grows by from the first seconds on
    Eigen::VectorXd share(covariance.rows());
    for (Eigen::Index k = 0; k < share.size(); ++k)
      share[k] = std::exp(-3.0 / found->terms[k].time_s) - std::exp(-time_s / found->terms[k].time_s);
    return std::sqrt(share.dot(covariance * share));
  };
  EXPECT_LT(deviationAfter(60.0), 1e-3);
  EXPECT_GT(deviationAfter(3600.0), 3.0 * deviationAfter(60.0));
}

TEST(CreepFit, ALoadThatMovesIsRefused) {
  auto all = readings({}, 60.0, 60.0);
  for (LoadReading& each : all) {
    if (each.at_s > 30.0 && each.phase == LoadPhase::kLoaded) each.amount -= 0.05;
  }
  EXPECT_FALSE(fitCreep(all, 60.0));
}

}  // namespace
}  // namespace tractiond::calibrate

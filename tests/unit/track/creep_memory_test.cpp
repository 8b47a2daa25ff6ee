#include "daemon/track/creep_memory.h"
#include "twin/creep.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tractiond::track {
namespace {

const std::vector<sensor::CreepTerm> kTerms = {
    {.share = 0.02, .time_s = 1.0, .deviation = 0.005},
    {.share = 0.03, .time_s = 20.0, .deviation = 0.01, .correlation = {-0.5}}};

/// A marker that forces displace by u, v [px] at times [s], on a gel that creeps as the twin's does.
class Gel {
 public:
  MarkerField at(double time_s, double u_px, double v_px) {
    sensor::Points elastic(3, 1);
    elastic << u_px, v_px, 0.0;
    creep_.advance(time_s, elastic);
    const sensor::Points moved = elastic + creep_.now();
    MarkerField markers;
    markers.resize(1);
    markers.displacement_px = {static_cast<float>(moved(0)), static_cast<float>(moved(1))};
    markers.valid = {1};
    markers.info.times.captured_ns = 1'000'000'000 + std::llround(1e9 * time_s);
    return markers;
  }

 private:
  twin::Creep creep_{{{.share = 0.02, .time_s = 1.0}, {.share = 0.03, .time_s = 20.0}}, 1};
};

TEST(CreepMemory, TakesOffWhatEarlierLoadsStillDisplaceWheneverFramesCome) {
  Gel gel;
  CreepMemory memory(kTerms, 1);
  std::mt19937 generator(7);
  std::uniform_real_distribution<double> interval_s(0.001, 3.0), displacement_px(-5.0, 5.0);
  double time_s = 0.0;
  double u_px = 0.0, v_px = 0.0;
  for (int i = 0; i < 500; ++i) {
    MarkerField markers = gel.at(time_s, u_px, v_px);
    memory.advance(markers);
    ASSERT_NEAR(markers.elastic_px[0], u_px, 1e-5) << "frame " << i;
    ASSERT_NEAR(markers.elastic_px[1], v_px, 1e-5) << "frame " << i;
    time_s += interval_s(generator);
    u_px = displacement_px(generator);
    v_px = displacement_px(generator);
  }
}

TEST(CreepMemory, StatesWhatErrorsOfTheSharesDoAfterAMinutesLoad) {
  Gel gel;
  CreepMemory memory(kTerms, 1);
  MarkerField markers;
  for (int i = 0; i <= 6000; ++i) {
    markers = gel.at(0.01 * i, 3.0, 0.0);
    memory.advance(markers);
  }
  const double first = 3.0 * (1.0 - std::exp(-60.0)), second = 3.0 * (1.0 - std::exp(-3.0));
  const double variance = std::pow(0.005 * first, 2) + std::pow(0.01 * second, 2) - 0.005 * 0.01 * first * second;
  EXPECT_NEAR(markers.creepError_px, std::sqrt(variance), 2e-4);
}

TEST(CreepMemory, HoldsAMarkerThatIsNotSeen) {
  Gel gel;
  CreepMemory memory(kTerms, 1);
  for (int i = 0; i <= 100; ++i) {
    MarkerField markers = gel.at(0.1 * i, 2.0, 1.0);
    if (i > 20 && i < 80) markers.valid = {0};
    memory.advance(markers);
    EXPECT_NEAR(markers.elastic_px[0], markers.valid[0] != 0 ? 2.0 : 0.0, 1e-4) << i;
  }
}

TEST(CreepMemory, BeginsAnewWithAnotherZero) {
  Gel gel;
  CreepMemory memory(kTerms, 1);
  for (int i = 0; i <= 100; ++i) {
    MarkerField markers = gel.at(0.1 * i, 2.0, 0.0);
    memory.advance(markers);
  }
  MarkerField markers = gel.at(10.1, 2.0, 0.0);
  markers.zero = {1};
  markers.displacement_px = {0.5F, 0.0F};
  memory.advance(markers);
  EXPECT_FLOAT_EQ(markers.elastic_px[0], 0.5F);
  EXPECT_FLOAT_EQ(markers.creepError_px, 0.0F);
}

TEST(CreepMemory, SaysAfterAStartThatItKnowsNothingOfBefore) {
  Gel gel;
  CreepMemory memory(kTerms, 1);
  memory.doubt();
  for (const auto& [time_s, isDoubted] : {std::pair(0.0, true), std::pair(59.0, true), std::pair(61.0, false)}) {
    MarkerField markers = gel.at(time_s, 0.0, 0.0);
    memory.advance(markers);
    EXPECT_EQ((markers.flags & kRecovering) != 0, isDoubted) << time_s;
  }
}

TEST(CreepMemory, DoesNothingWhereTimeDoesNotAdvance) {
  CreepMemory memory(kTerms, 1);
  Gel gel;
  for (const double time_s : {0.0, 5.0, 1.0, 1.0}) {
    MarkerField markers = gel.at(time_s, 2.0, 0.0);
    markers.displacement_px = {2.0F, 0.0F};
    memory.advance(markers);
    EXPECT_TRUE(std::isfinite(markers.elastic_px[0]));
    EXPECT_NEAR(markers.elastic_px[0], 2.0, 0.12) << time_s;
  }
}

}  // namespace
}  // namespace tractiond::track

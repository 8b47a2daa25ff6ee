#include "daemon/track/lattice.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <initializer_list>
#include <random>
#include <tuple>

namespace tractiond::track::lattice_test {
namespace {

constexpr float kSpacing = 19.0F;

struct Grid {
  Lattice lattice{3, 24, 24};  // not from index 0 on
  std::vector<Vector> field = std::vector<Vector>(3 + 24 * 24);
  std::vector<std::uint8_t> valid = std::vector<std::uint8_t>(3 + 24 * 24, 1);

  template <typename F>
  void fill(F f) {
    for (int row = 0; row < 24; ++row) {
      for (int column = 0; column < 24; ++column) field[lattice.at(column, row)] = f(column, row);
    }
  }
  int invalid() const { return static_cast<int>(std::count(valid.begin(), valid.end(), 0)); }
};

/// How many more markers are not valid afterwards.
int pruned(Grid& grid, Trust& trust, bool thorough) {
  const int before = grid.invalid();
  trust.prune(grid.field, grid.valid, thorough);
  return grid.invalid() - before;
}

Vector steepBump(int column, int row) {  // 29 px high, 0.4 spacings between neighbours where it is steepest
  const double r2 = std::pow(column - 11.3, 2) + std::pow(row - 12.1, 2);
  const auto height = static_cast<float>(29.0 * std::exp(-0.5 * r2 / (2.31 * 2.31)));
  return {0.8F * height, -0.6F * height};
}

TEST(Expectation, ContinuesAPlaneExactlyWhereverTheNodesAre) {
  Grid grid;
  const auto plane = [](int column, int row) {
    return Vector{0.3F * static_cast<float>(column) - 2.0F, 1.0F - 0.2F * static_cast<float>(row)};
  };
  grid.fill(plane);
  std::mt19937 random(1);
  for (auto& valid : grid.valid) valid = random() % 5 != 0;
  for (int row = 0; row < 24; ++row) {
    for (int column = 0; column < 24; ++column) {
      const auto found = expectation(grid.lattice, grid.lattice.at(column, row), grid.field, grid.valid);
      ASSERT_TRUE(found);
      EXPECT_NEAR(found->u, plane(column, row).u, 0.15) << column << ' ' << row;
      EXPECT_NEAR(found->v, plane(column, row).v, 0.15) << column << ' ' << row;
    }
  }
}

TEST(Expectation, SaysNothingWithoutNeighbours) {
  Grid grid;
  std::fill(grid.valid.begin(), grid.valid.end(), std::uint8_t{0});
  grid.valid[grid.lattice.at(5, 5)] = 1;
  EXPECT_FALSE(expectation(grid.lattice, grid.lattice.at(5, 5), grid.field, grid.valid));
  EXPECT_FALSE(expectation(grid.lattice, grid.lattice.at(8, 5), grid.field, grid.valid));
  EXPECT_TRUE(expectation(grid.lattice, grid.lattice.at(6, 6), grid.field, grid.valid));
}

TEST(IsolatedGaps, AreThoseWithHalfOfTheEightNodesAround) {
  Grid grid;
  const auto gaps = [&](std::initializer_list<std::array<int, 2>> missing) {
    std::fill(grid.valid.begin(), grid.valid.end(), std::uint8_t{1});
    for (const auto [column, row] : missing) grid.valid[grid.lattice.at(column, row)] = 0;
    return isolatedGaps(grid.lattice, grid.valid);
  };
  EXPECT_EQ(gaps({}), 0);
  EXPECT_EQ(gaps({{5, 5}, {12, 0}, {0, 12}}), 3);
  EXPECT_EQ(gaps({{0, 0}, {23, 23}}), 0) << "three nodes around a corner";
  EXPECT_EQ(gaps({{5, 5}, {6, 5}, {5, 6}, {6, 6}}), 4);
  EXPECT_EQ(gaps({{4, 4}, {5, 4}, {6, 4}, {4, 5}, {5, 5}, {6, 5}, {4, 6}, {5, 6}, {6, 6}}), 4) << "a hole's corners";
  std::fill(grid.valid.begin(), grid.valid.end(), std::uint8_t{1});
  for (int row = 0; row < 24; ++row) {
    for (const int column : {0, 10, 17, 18}) grid.valid[grid.lattice.at(column, row)] = 0;
  }
  EXPECT_EQ(isolatedGaps(grid.lattice, grid.valid), 24) << "of a column within others; not of the first, not of two";
}

TEST(Trust, SteepButSmoothFieldsPass) {
  Grid grid;
  grid.fill(steepBump);
  Trust trust(grid.lattice, kSpacing);
  EXPECT_EQ(pruned(grid, trust, true), 0);
  grid.fill([](int column, int) { return Vector{0.4F * kSpacing * static_cast<float>(column), 0.0F}; });
  EXPECT_EQ(pruned(grid, trust, true), 0);
}

TEST(Trust, ASingleSwapOrWrongFixIsDroppedAlone) {
  for (const auto& [column, row, share] : {std::tuple(23, 0, 1.0F), {9, 10, 1.0F}, {18, 18, 0.35F}}) {
    Grid grid;
    grid.fill(steepBump);
    const int node = grid.lattice.at(column, row);
    grid.field[node].u += share * kSpacing;
    Trust trust(grid.lattice, kSpacing);
    EXPECT_EQ(pruned(grid, trust, false), 1);
    EXPECT_EQ(grid.valid[node], 0);
  }
}

TEST(Trust, ASwappedPatchIsDroppedWholeAndNothingElse) {
  Grid grid;
  grid.fill([](int column, int row) {
    const bool patch = column > 4 && column < 10 && row > 6 && row < 11;
    return steepBump(column, row) + Vector{patch ? -kSpacing : 0.0F, 0.0F};
  });
  Trust trust(grid.lattice, kSpacing);
  trust.prune(grid.field, grid.valid, false);
  for (int row = 0; row < 24; ++row) {
    for (int column = 0; column < 24; ++column) {
      const bool patch = column > 4 && column < 10 && row > 6 && row < 11;
      const bool near = column > 2 && column < 12 && row > 4 && row < 13;
      const bool valid = grid.valid[grid.lattice.at(column, row)] != 0;
      EXPECT_FALSE(patch && valid) << column << ' ' << row;
      EXPECT_TRUE(near || valid) << column << ' ' << row;
    }
  }
}

TEST(Trust, BothSidesOfAStepWithinAPieceAreDropped) {
  Grid grid;
  grid.fill([](int column, int row) {  // rows from 11 on are 12 px off in the middle, and connected at the sides
    const auto x = static_cast<float>(column) - 11.0F, y = static_cast<float>(row) - 11.0F;
    return Vector{row < 11 ? 0.0F : 12.0F * std::exp(-x * x / 20.0F - y / 4.0F), 0.0F};
  });
  Trust trust(grid.lattice, kSpacing);
  trust.prune(grid.field, grid.valid, true);
  for (const int row : {10, 11}) EXPECT_FALSE(grid.valid[grid.lattice.at(11, row)]) << row;
  for (const int row : {9, 13}) EXPECT_TRUE(grid.valid[grid.lattice.at(11, row)]) << row;
}

TEST(Trust, WhatIsCutOffIsNotTrustedWhenLookedAtThoroughly) {
  Grid grid;
  for (int row = 0; row < 24; ++row) {
    for (int column = 0; column < 24; ++column) {
      const int r = std::max(std::abs(column - 12), std::abs(row - 12));
      if (r == 3 || r == 4) grid.valid[grid.lattice.at(column, row)] = 0;
    }
  }
  Trust trust(grid.lattice, kSpacing);
  EXPECT_EQ(pruned(grid, trust, false), 0);
  EXPECT_EQ(pruned(grid, trust, true), 25);
  EXPECT_EQ(grid.valid[grid.lattice.at(12, 12)], 0);
}

}  // namespace
}  // namespace tractiond::track::lattice_test

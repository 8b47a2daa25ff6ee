// A round contact as forces on nodes.
#pragma once

#include <array>

namespace tractiond::solve {

/// A round patch on the grid of the nodes.
struct Patch {
  double column = 0.0, row = 0.0;  ///< of its centre [pitches]
  double spread = 0.0;             ///< variance of its pressure's places along any direction [pitches^2]
  std::array<double, 3> force_N{};
};

/// Shares of the 4 x 4 nodes around a place that do what a patch does: its moments up to the third. Of each node, the
/// share and its derivatives by column, row and spread.
struct Stencil {
  static constexpr int kNodes = 16;
  Stencil() = default;
  Stencil(const Patch& patch, int columns, int rows);

  std::array<int, kNodes> node{};
  std::array<std::array<double, 4>, kNodes> share{};
};

}  // namespace tractiond::solve

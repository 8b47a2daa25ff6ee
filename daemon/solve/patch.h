// Represents a round contact by forces on nodes.
#pragma once

#include <array>

namespace tractiond::solve {

/// A round patch on the grid of the nodes.
struct Patch {
  double column = 0.0, row = 0.0;   ///< of its centre [pitches]
  double spread = 0.0;              ///< variance of its pressure's places along any direction [pitches^2]
  std::array<double, 3> force_N{};  ///< gel frame
};

/// Shares of the 4 x 4 nodes around a patch in its force, with which the moments of the patch are right up to the
/// third.
struct Stencil {
  static constexpr int kNodes = 16;
  Stencil() = default;
  /// Computes the shares on a grid of nodes of this size, at least 4 x 4. Off the grid the nearest 4 x 4 nodes
  /// extrapolate. Does not use Patch::force_N.
  Stencil(const Patch& patch, int columns, int rows);

  std::array<int, kNodes> node{};                     ///< indices of the nodes
  std::array<std::array<double, 4>, kNodes> share{};  ///< of each: share, its derivatives by column, row and spread
};

}  // namespace tractiond::solve

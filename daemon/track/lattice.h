// The grids of markers as neighbourhoods: what a marker's neighbours say of it.
#pragma once

#include "daemon/records/gel_report.h"
#include "sensor/sensor.h"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace tractiond::track {

struct Vector {
  float u = 0.0F, v = 0.0F;  ///< px
  friend Vector operator+(Vector a, Vector b) { return {a.u + b.u, a.v + b.v}; }
  friend Vector operator-(Vector a, Vector b) { return {a.u - b.u, a.v - b.v}; }
  friend Vector operator*(float s, Vector a) { return {s * a.u, s * a.v}; }
  float squared() const { return u * u + v * v; }
};

/// A grid whose node (column, row) has the index first + row * columns + column.
struct Lattice {
  int first = 0;
  int columns = 0, rows = 0;

  int count() const { return columns * rows; }
  int at(int column, int row) const { return first + row * columns + column; }
  bool has(int column, int row) const { return column >= 0 && column < columns && row >= 0 && row < rows; }
};

/// Returns `seen`, but at least the columns and rows between the first and the last of which half of the markers are
/// `there`, by marker: what hid them when the picture was labelled has gone. Reentrant; allocates nothing.
LatticeSeen extentWith(const LatticeSeen& seen, const Lattice& lattice, std::span<const std::uint8_t> there);

/// Returns the number of markers that are not `there` although at least four of the eight nodes around each of them
/// are: what they would show, their neighbours show too. Reentrant; allocates nothing.
int isolatedGaps(const Lattice& lattice, std::span<const std::uint8_t> there);

/// One per layer, in their order.
std::vector<Lattice> latticesOf(const sensor::Sensor& sensor);

/// The value that a smooth field has at (column, row), which itself is left out: a plane fitted to the valid nodes up
/// to two steps away, the near ones weighing more. `nodes` counts the valid ones among the eight nearest; nothing where
/// that is 0. Reentrant.
struct Expectation {
  Vector value;
  int nodes = 0;
};
std::optional<Expectation> expectation(const Lattice& lattice, int column, int row, std::span<const Vector> field,
                                       std::span<const std::uint8_t> valid);

/// Finds markers that were taken for others. In a smooth field neighbours' displacements differ by less than half the
/// spacing, even where it is steep; a swap is an error of a whole one. What does not belong to the largest piece that
/// hangs together is not trusted.
/// Thread-bound. Allocates only in the constructor.
class Trust {
 public:
  Trust(const Lattice& lattice, float spacing_px);

  /// Sets valid to 0 where the displacement contradicts its surroundings. Returns how many. Looks only at this
  /// lattice's nodes. `thorough`: look for pieces that hang apart even where no neighbours contradict each other.
  int prune(std::span<const Vector> displacement, std::span<std::uint8_t> valid, bool thorough);

 private:
  bool contradicts(std::span<const Vector> displacement, int a, int b) const {
    return (displacement[a] - displacement[b]).squared() > limit2_;
  }
  bool anyContradiction(std::span<const Vector> displacement, std::span<const std::uint8_t> valid) const;
  int dropOutliers(std::span<const Vector> displacement, std::span<std::uint8_t> valid);
  int keepLargestPiece(std::span<const Vector> displacement, std::span<std::uint8_t> valid);

  Lattice lattice_;
  float limit2_;            ///< px^2
  std::vector<int> piece_;  ///< per node
  std::vector<int> stack_;
};

}  // namespace tractiond::track

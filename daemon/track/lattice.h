// Grids of markers: checks and predicts a marker by its neighbours.
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
  float squared() const { return u * u + v * v; }  ///< Returns the square of the length [px^2].
};

/// A grid whose node (column, row) has the index first + row * columns + column.
struct Lattice {
  int first = 0;
  int columns = 0, rows = 0;

  int count() const { return columns * rows; }  ///< Returns the number of nodes.
  /// Returns the index of a node; does not check whether there is one.
  int at(int column, int row) const { return first + row * columns + column; }
  /// Returns whether there is a node (column, row).
  bool has(int column, int row) const { return column >= 0 && column < columns && row >= 0 && row < rows; }
};

/// Returns `seen`, extended to the number of columns and rows from the first to the last of which at least half of the
/// markers are `there`: they may have been hidden when the picture was labelled. Never fewer than `seen`. Reentrant;
/// allocates nothing.
/// \param there by marker of all layers, 1: it is seen
LatticeSeen extentWith(const LatticeSeen& seen, const Lattice& lattice, std::span<const std::uint8_t> there);

/// Returns the number of markers that are not `there` although at least four of the eight nodes around each of them
/// are, so that their neighbours make up for them. Reentrant; allocates nothing.
/// \param there by marker of all layers
int isolatedGaps(const Lattice& lattice, std::span<const std::uint8_t> there);

/// Returns the lattices of the sensor's layers, in their order; the indices are those of sensor::markerPositions.
std::vector<Lattice> latticesOf(const sensor::Sensor& sensor);

/// Weighted least squares of a plane through values on a grid. Reentrant; allocates nothing.
class PlaneFit {
 public:
  void add(float weight, float x, float y, Vector value) {
    w_ += weight;
    wx_ += weight * x;
    wy_ += weight * y;
    wxx_ += weight * x * x;
    wxy_ += weight * x * y;
    wyy_ += weight * y * y;
    f_ = f_ + weight * value;
    fx_ = fx_ + weight * x * value;
    fy_ = fy_ + weight * y * value;
  }

  /// Solves about the weighted centre: the slopes first, then the value there. Must be called after the last add() and
  /// before at().
  void solve() {
    constexpr float kSlopePrior = 0.01F;  // keeps the slope finite if the places lie in one line
    mx_ = wx_ / w_;
    my_ = wy_ / w_;
    mean_ = (1.0F / w_) * f_;
    const float xx = wxx_ - w_ * mx_ * mx_ + kSlopePrior, yy = wyy_ - w_ * my_ * my_ + kSlopePrior,
                xy = wxy_ - w_ * mx_ * my_;
    const Vector sx = fx_ - (w_ * mx_) * mean_, sy = fy_ - (w_ * my_) * mean_;
    const float inverse = 1.0F / (xx * yy - xy * xy);
    slopeX_ = inverse * (yy * sx - xy * sy);
    slopeY_ = inverse * (xx * sy - xy * sx);
  }

  /// Returns the plane's value.
  Vector at(float x, float y) const { return mean_ + (x - mx_) * slopeX_ + (y - my_) * slopeY_; }

 private:
  float w_ = 0, wx_ = 0, wy_ = 0, wxx_ = 0, wxy_ = 0, wyy_ = 0;
  Vector f_, fx_, fy_;
  float mx_ = 0, my_ = 0;
  Vector mean_, slopeX_, slopeY_;
};

/// Predicts the value of a smooth field at a node from its neighbours: fits a plane to the valid nodes up to two
/// steps away, with larger weights for near ones. Returns nothing if none of the eight nearest is valid. Reentrant;
/// allocates nothing.
/// \param field, valid by marker of all layers; that of the node itself is not used
std::optional<Vector> expectation(const Lattice& lattice, int node, std::span<const Vector> field,
                                  std::span<const std::uint8_t> valid);

/// Finds markers that were taken for others. In a smooth field neighbours' displacements differ by less than half the
/// spacing, even where it is steep; a swap is an error of a whole spacing. Only the largest connected piece of the
/// lattice is trusted.
/// Thread-bound. Allocates only in the constructor.
class Trust {
 public:
  /// \param spacing_px distance between neighbours of the lattice in the untouched gel
  Trust(const Lattice& lattice, float spacing_px);

  /// Sets `valid` to 0 where the displacement contradicts its surroundings. Always: outliers of their row and column,
  /// which differ from the mean of the neighbours on both sides by more than a quarter of the spacing. Then, if
  /// `thorough`, or if neighbours still contradict each other: all but the largest connected piece, and both of two
  /// neighbours in it that contradict each other. Considers only this lattice's nodes.
  /// \param thorough true: looks for separate pieces even if no neighbours contradict each other
  /// \param displacement, valid by marker of all layers
  void prune(std::span<const Vector> displacement, std::span<std::uint8_t> valid, bool thorough);

 private:
  bool contradicts(std::span<const Vector> displacement, int a, int b) const {
    return (displacement[a] - displacement[b]).squared() > limit2_;
  }
  bool anyContradiction(std::span<const Vector> displacement, std::span<const std::uint8_t> valid) const;
  void dropOutliers(std::span<const Vector> displacement, std::span<std::uint8_t> valid);
  void keepLargestPiece(std::span<const Vector> displacement, std::span<std::uint8_t> valid);
  void dropContradicting(std::span<const Vector> displacement, std::span<std::uint8_t> valid);

  Lattice lattice_;
  float limit2_;            ///< px^2
  std::vector<int> piece_;  ///< per node
  std::vector<int> stack_;
};

}  // namespace tractiond::track

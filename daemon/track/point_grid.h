// Sorts points of the picture into square cells, to find those near a place.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace tractiond::track {

/// Thread-bound. Allocates only in the constructor; add() takes at most `capacity` points, each once until clear().
class PointGrid {
 public:
  /// \param width_px, height_px size of the picture
  /// \param cell_px side of a cell
  /// \param capacity largest number of points
  PointGrid(int width_px, int height_px, float cell_px, int capacity)
      : cell_(cell_px)
      , columns_(static_cast<int>(static_cast<float>(width_px) / cell_px) + 1)
      , rows_(static_cast<int>(static_cast<float>(height_px) / cell_px) + 1)
      , first_(static_cast<std::size_t>(columns_ * rows_), -1)
      , next_(static_cast<std::size_t>(capacity), -1) {}

  /// Removes all points.
  void clear() { std::fill(first_.begin(), first_.end(), -1); }

  /// Adds a point, from 0 to capacity - 1, at (u, v) [px]. Points outside the picture are put into its border cells.
  void add(int point, float u, float v) {
    int& first = first_[row(v) * columns_ + column(u)];
    next_[point] = first;
    first = point;
  }

  /// Calls visit(point) for all points within `reach` [px] of (u, v), and for some that are farther away; in no order.
  template <typename Visit>
  void near(float u, float v, float reach, Visit&& visit) const {
    const int right = column(u + reach), bottom = row(v + reach);
    for (int y = row(v - reach); y <= bottom; ++y) {
      for (int x = column(u - reach); x <= right; ++x) {
        for (int point = first_[y * columns_ + x]; point >= 0; point = next_[point]) visit(point);
      }
    }
  }

 private:
  int column(float u) const { return std::clamp(static_cast<int>(u / cell_), 0, columns_ - 1); }
  int row(float v) const { return std::clamp(static_cast<int>(v / cell_), 0, rows_ - 1); }

  float cell_;
  int columns_, rows_;
  std::vector<int> first_, next_;
};

}  // namespace tractiond::track

// Grows the grid of a chessboard's inner corners from a partial detection.
#pragma once

#include <opencv2/core.hpp>

#include <vector>

namespace lens {

/// Positions in the picture (u, v) [px].
using Places = std::vector<cv::Point2f>;

/// Inner corners of a chessboard, row by row.
struct CornerGrid {
  cv::Size size = {0, 0};  ///< number of columns and rows
  Places places;

  /// Returns the corner in column x and row y, counted from 0 and not checked.
  const cv::Point2f& at(int x, int y) const { return places[static_cast<std::size_t>(y * size.width + x)]; }
};

/// Grows the full corner grid from `found`, of which at least one square must be correct: one whose four corners have
/// similar contrast with alternating sign. Each next corner is expected where the distances of its neighbours, and
/// their change, place it. It is accepted if the four squares around it have the right colours at the full contrast of
/// its neighbour; on the border of a board the contrast is half. Returns an empty grid (size 0 x 0) unless the result,
/// the largest if there are several, is a rectangle.
/// \param grey one channel of 8 bits
/// \param found need not be complete or right; may be empty Reentrant.
CornerGrid grown(const cv::Mat& grey, const CornerGrid& found);

}  // namespace lens

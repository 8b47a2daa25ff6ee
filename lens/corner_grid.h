// The inner corners of a chessboard as a grid, grown from what a search for boards has found of it.
#pragma once

#include <opencv2/core.hpp>

#include <vector>

namespace lens {

using Places = std::vector<cv::Point2f>;

/// Row after row; x goes to the right of y, as on a board that is looked at from its front.
struct CornerGrid {
  cv::Size size = {0, 0};
  Places places;

  const cv::Point2f& at(int x, int y) const { return places[static_cast<std::size_t>(y * size.width + x)]; }
};

/// All that hangs together of the board that `found` shows a part of, of which a single square need be right: it is
/// where four corners, dark and light in turn, are equally strong. From there a corner is looked for where its
/// neighbours' own distances, and their change, put it; it is one if around it the four squares have the right colours
/// at the full contrast of its neighbour (on the border of a board it is half). Empty unless that is a rectangle.
/// \param grey 8 bits. Reentrant.
CornerGrid grown(const cv::Mat& grey, const CornerGrid& found);

}  // namespace lens

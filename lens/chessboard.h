// The corners of a chessboard in a picture.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <tl/expected.hpp>

#include <string>

namespace lens {

/// A plain chessboard on white. Its inner corners, columns - 1 times rows - 1 of them, are what is seen of it.
struct Board {
  int columns = 9, rows = 6;  ///< squares along its sides, at least 4
  double square = 10e-3;      ///< [m]

  int corners() const { return (columns - 1) * (rows - 1); }
  Eigen::Vector2d corner(int index) const;  ///< on the board [m], row after row
};

/// What a picture shows of it.
struct Corners {
  Eigen::Matrix2Xd place_px;  ///< 2 x board.corners()
  double edgeWidth_px = 0.0;  ///< in which brightness rises from 10 to 90 %, mean over the edges between squares
  double smallestSquare_px = 0.0;
};

/// \param grey 8 bits. The error says what is seen instead, for people; it does not name the picture. Reentrant.
tl::expected<Corners, std::string> findCorners(const cv::Mat& grey, const Board& board);

}  // namespace lens

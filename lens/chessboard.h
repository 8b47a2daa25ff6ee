// Finds the corners of a chessboard in a picture.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <tl/expected.hpp>

#include <string>

namespace lens {

/// A plain chessboard with a white margin. Only its inner corners are used: (columns - 1) x (rows - 1).
struct Board {
  int columns = 9, rows = 6;  ///< number of squares along its sides, at least 4 (not checked)
  double square = 10e-3;      ///< side of a square along a row, x [m]
  double tall = 1.0;          ///< side of a square along y, relative to that along x

  int corners() const { return (columns - 1) * (rows - 1); }  ///< Returns the number of inner corners.
  /// Returns the place of an inner corner on the board [m]. They are counted row by row; the first one is the origin, x
  /// runs along a row, y across.
  /// \param index 0 to corners() - 1
  Eigen::Vector2d corner(int index) const;
};

/// The corners that a picture shows.
struct Corners {
  /// (u, v), 2 x board.corners(), in the order of Board::corner(); a board turned by 180 degrees gives those of a board
  /// that is not turned.
  Eigen::Matrix2Xd place_px;
  /// Mean distance over which the brightness rises from 10 to 90 % at the edges between squares: of the edges across
  /// the rows or along them, whichever is larger.
  double edgeWidth_px = 0.0;
  double smallestSquare_px = 0.0;  ///< smallest distance between neighbouring corners
};

/// Finds all inner corners of the board. On failure returns a sentence about what the picture shows instead, without
/// its name: no board, a board of another size, too little contrast, or blur.
/// \param grey one channel of 8 bits Reentrant.
tl::expected<Corners, std::string> findCorners(const cv::Mat& grey, const Board& board);

}  // namespace lens

#include "lens/chessboard.h"

#include "lens/corner_grid.h"
#include "lens/saddle_fit.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace lens {

namespace {

constexpr double kEdgeLimit = 0.35;  // of a square: the images of wider edges overlap
constexpr double kContrastLimit = 15.0;
constexpr int kLeastOther = 16;    // smallest number of corners for a board of another size to be reported
const cv::Size kLeastBoard(3, 3);  // corners: start of a search for a board of any size
// Widths of the searched copies. OpenCV finds boards in no more pictures at full size, and takes ten times as long; a
// board missed at one width is often found at another.
constexpr std::array kSearched_px = {640, 1000, 400};

/// Searches a reduced copy for a board or a part of it. Returns positions in the picture itself. They are only a start:
/// in about one of a hundred pictures OpenCV's search skips rows, takes corners on the border for inner ones, or
/// diagonals for sides.
/// \param least true: the grid found may be larger than `size`
CornerGrid search(const cv::Mat& grey, int width_px, cv::Size size, bool least) {
  const double scale = std::min(1.0, static_cast<double>(width_px) / grey.cols);
  cv::Mat small, found;
  cv::resize(grey, small, {}, scale, scale, cv::INTER_AREA);
  CornerGrid grid;
  if (!cv::findChessboardCornersSB(small, size, grid.places, least ? cv::CALIB_CB_LARGER : 0, found)) return {};
  grid.size = least ? found.size() : size;
  if (grid.places.size() != static_cast<std::size_t>(grid.size.area())) return {};
  for (cv::Point2f& place : grid.places) {
    place.x = static_cast<float>((place.x + 0.5) / scale - 0.5);
    place.y = static_cast<float>((place.y + 0.5) / scale - 0.5);
  }
  return grid;
}

bool isOfSize(const CornerGrid& grid, cv::Size size) {
  return grid.size == size || grid.size == cv::Size(size.height, size.width);
}

/// Returns the board of the expected size, or the largest one found.
CornerGrid boardIn(const cv::Mat& grey, cv::Size expected) {
  CornerGrid largest;
  for (const int width_px : kSearched_px) {
    for (const bool least : {false, true}) {
      CornerGrid board = grown(grey, search(grey, width_px, least ? kLeastBoard : expected, least));
      if (isOfSize(board, expected)) return board;
      if (board.size.area() > largest.size.area()) largest = std::move(board);
    }
  }
  return largest;
}

/// Reorders a grid of the expected size: y 90 degrees clockwise from x, the first corner above or left of the last.
/// Returns false if it has another size.
bool arrange(CornerGrid& grid, cv::Size size) {
  if (!isOfSize(grid, size)) return false;
  const auto reorder = [&](auto from) {
    CornerGrid ordered{size, {}};
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) ordered.places.push_back(from(x, y));
    }
    grid = std::move(ordered);
  };
  if (grid.size != size) reorder([&](int x, int y) { return grid.at(y, x); });
  const cv::Point2f along = grid.at(1, 0) - grid.at(0, 0), across = grid.at(0, 1) - grid.at(0, 0);
  const bool isMirrored = along.cross(across) < 0.0;  // rows run the other way
  if (isMirrored) reorder([&](int x, int y) { return grid.at(x, size.height - 1 - y); });
  const cv::Point2f first = grid.places.front(), last = grid.places.back();
  if (first.x + first.y > last.x + last.y) std::ranges::reverse(grid.places);
  return true;
}

/// Returns a sentence about what the picture shows instead of the board.
std::string otherBoard(const CornerGrid& seen, const Board& board) {
  const std::string missing =
      "shows no chessboard of " + std::to_string(board.columns) + "x" + std::to_string(board.rows) + " squares";
  if (seen.size.area() < kLeastOther) {  // noise contains small grids
    return missing + ": it must lie in the picture as a whole, sharp, evenly lit, with a white margin around it";
  }
  const auto [less, more] = std::minmax({seen.size.width + 1, seen.size.height + 1});
  const bool isUpright = board.columns < board.rows;
  return missing + ", but one of " + std::to_string(isUpright ? less : more) + "x" +
         std::to_string(isUpright ? more : less) +
         ": count the squares along the sides, black and white, not the corners between them";
}

double smallestSquare(const CornerGrid& grid) {
  double least = std::numeric_limits<double>::infinity();
  for (int y = 0; y < grid.size.height; ++y) {
    for (int x = 0; x < grid.size.width; ++x) {
      if (x > 0) least = std::min(least, cv::norm(grid.at(x, y) - grid.at(x - 1, y)));
      if (y > 0) least = std::min(least, cv::norm(grid.at(x, y) - grid.at(x, y - 1)));
    }
  }
  return least;
}

std::string rounded(double value) {
  return std::to_string(static_cast<int>(std::lround(value)));
}

}  // namespace

Eigen::Vector2d Board::corner(int index) const {
  return square * Eigen::Vector2d(index % (columns - 1), tall * (index / (columns - 1)));
}

tl::expected<Corners, std::string> findCorners(const cv::Mat& grey, const Board& board) {
  const cv::Size size(board.columns - 1, board.rows - 1);
  CornerGrid grid = boardIn(grey, size);
  if (!arrange(grid, size)) return tl::unexpected(otherBoard(grid, board));
  Places& places = grid.places;
  Corners corners;
  corners.smallestSquare_px = smallestSquare(grid);
  const cv::Scalar across = cv::estimateChessboardSharpness(grey, size, places, 0.8F, false);
  const cv::Scalar down = cv::estimateChessboardSharpness(grey, size, places, 0.8F, true);
  corners.edgeWidth_px = std::max(across[0], down[0]);
  if (across[2] - across[1] < kContrastLimit) {
    return tl::unexpected("is too dark: white is only " + rounded(across[2] - across[1]) +
                          " levels brighter than black; expose longer");
  }
  if (corners.edgeWidth_px > kEdgeLimit * corners.smallestSquare_px) {
    return tl::unexpected("is blurred: edges are " + rounded(corners.edgeWidth_px) + " px wide, squares " +
                          rounded(corners.smallestSquare_px) + " px; focus, and keep the board still");
  }
  // A wider window has less noise; half a square contains only the two edges that cross.
  const int half = std::max(2, static_cast<int>(0.4 * corners.smallestSquare_px));
  cv::cornerSubPix(grey, places, {half, half}, {-1, -1}, {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 100, 1e-4});
  constexpr double kRise = 2.563;  // distance of the 10 and 90 % levels of an edge, in standard deviations of its blur
  fitSaddles(grey, std::max(3.0, 0.42 * corners.smallestSquare_px), std::max(0.4, corners.edgeWidth_px / kRise), grid);
  corners.place_px.resize(2, board.corners());
  for (int i = 0; i < board.corners(); ++i) {
    const cv::Point2f place = places[static_cast<std::size_t>(i)];
    corners.place_px.col(i) << place.x, place.y;
  }
  return corners;
}

}  // namespace lens

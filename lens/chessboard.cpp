#include "lens/chessboard.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace lens {

namespace {

using Places = std::vector<cv::Point2f>;

constexpr double kSaddle = 0.75;     // of the contrast: an outer corner of the board has a half, an inner one all
constexpr double kEdgeLimit = 0.35;  // of a square: wider edges run into each other
constexpr double kContrastLimit = 15.0;
constexpr int kLeastOther = 16;    // corners of a board that is named in place of the right one
constexpr int kSearched_px = 640;  // wide: boards are found in no more, and ten times faster than in all pixels

/// Searched in a small copy, places of the picture itself. False: not there as a whole. `least`: the size found may be
/// larger than the one given, and is then put there.
bool find(const cv::Mat& grey, cv::Size& corners, bool least, Places& places) {
  const double scale = std::min(1.0, static_cast<double>(kSearched_px) / grey.cols);
  cv::Mat small, found;
  cv::resize(grey, small, {}, scale, scale, cv::INTER_AREA);
  if (!cv::findChessboardCornersSB(small, corners, places, least ? cv::CALIB_CB_LARGER : 0, found)) return false;
  corners = found.size();
  for (cv::Point2f& place : places) {
    place.x = static_cast<float>((place.x + 0.5) / scale - 0.5);
    place.y = static_cast<float>((place.y + 0.5) / scale - 0.5);
  }
  return true;
}

/// Mean over a small square; not finite outside the picture.
double levelAt(const cv::Mat& grey, cv::Point2f place) {
  constexpr int kHalf = 1;
  const int u = static_cast<int>(std::lround(place.x)), v = static_cast<int>(std::lround(place.y));
  if (u < kHalf || v < kHalf || u >= grey.cols - kHalf || v >= grey.rows - kHalf) return std::nan("");
  return cv::mean(grey(cv::Rect(u - kHalf, v - kHalf, 2 * kHalf + 1, 2 * kHalf + 1)))[0];
}

/// (light - dark) of the four squares around a corner, by steps of a third of a square.
double saddle(const cv::Mat& grey, cv::Point2f corner, cv::Point2f along, cv::Point2f across) {
  const cv::Point2f one = (along + across) / 3.0F, other = (along - across) / 3.0F;
  return 0.5 * std::abs(levelAt(grey, corner + one) + levelAt(grey, corner - one) - levelAt(grey, corner + other) -
                        levelAt(grey, corner - other));
}

/// Whether beyond the outermost corners on some side there is another row of them: the board has more squares.
bool goesOn(const cv::Mat& grey, const Places& places, cv::Size size) {
  const auto at = [&](int x, int y) { return places[static_cast<std::size_t>(y * size.width + x)]; };
  for (int side = 0; side < 4; ++side) {
    const bool isRow = side < 2, isFirst = side % 2 == 0;
    const int count = isRow ? size.width : size.height, depth = isRow ? size.height : size.width;
    const int last = isFirst ? 0 : depth - 1, before = isFirst ? 1 : depth - 2;
    int saddles = 0;
    for (int i = 0; i < count; ++i) {
      const cv::Point2f border = isRow ? at(i, last) : at(last, i), inner = isRow ? at(i, before) : at(before, i);
      const int next = i + 1 < count ? i + 1 : i - 1;
      const cv::Point2f along = (isRow ? at(next, last) : at(last, next)) - border, outward = border - inner;
      saddles +=
          saddle(grey, border + outward, along, outward) > kSaddle * saddle(grey, border, along, outward) ? 1 : 0;
    }
    if (2 * saddles > count) return true;
  }
  return false;
}

/// What is there in place of the board.
std::string otherBoard(const cv::Mat& grey, const Board& board) {
  const std::string missing =
      "shows no chessboard of " + std::to_string(board.columns) + "x" + std::to_string(board.rows) + " squares";
  cv::Size seen(4, 3);
  Places places;
  // Noise has small boards in it, and of a large one often but a part is found: what goes on is not the whole.
  if (!find(grey, seen, true, places) || seen.area() < kLeastOther || goesOn(grey, places, seen)) {
    return missing + ": it must lie in the picture as a whole, sharp, evenly lit, with a white margin around it";
  }
  const auto [less, more] = std::minmax({seen.width + 1, seen.height + 1});
  const bool isUpright = board.columns < board.rows;
  return missing + ", but one of " + std::to_string(isUpright ? less : more) + "x" +
         std::to_string(isUpright ? more : less) +
         ": count the squares along the sides, black and white, not the corners between them";
}

double smallestSquare(const Places& places, cv::Size size) {
  double least = std::numeric_limits<double>::infinity();
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const cv::Point2f here = places[static_cast<std::size_t>(y * size.width + x)];
      if (x > 0) least = std::min(least, cv::norm(here - places[static_cast<std::size_t>(y * size.width + x - 1)]));
      if (y > 0) least = std::min(least, cv::norm(here - places[static_cast<std::size_t>((y - 1) * size.width + x)]));
    }
  }
  return least;
}

std::string rounded(double value) {
  return std::to_string(static_cast<int>(std::lround(value)));
}

}  // namespace

Eigen::Vector2d Board::corner(int index) const {
  return square * Eigen::Vector2d(index % (columns - 1), index / (columns - 1));
}

tl::expected<Corners, std::string> findCorners(const cv::Mat& grey, const Board& board) {
  Places places;
  const cv::Size size(board.columns - 1, board.rows - 1);
  cv::Size found = size;
  if (!find(grey, found, false, places) || found != size) return tl::unexpected(otherBoard(grey, board));
  if (goesOn(grey, places, size)) {
    return tl::unexpected("shows a chessboard of more than " + std::to_string(board.columns) + "x" +
                          std::to_string(board.rows) + " squares");
  }
  Corners corners;
  corners.smallestSquare_px = smallestSquare(places, size);
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
  // The wider the window, the less noise; half a square holds the two edges that cross and no other.
  const int half = std::max(2, static_cast<int>(0.4 * corners.smallestSquare_px));
  cv::cornerSubPix(grey, places, {half, half}, {-1, -1}, {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 100, 1e-4});
  corners.place_px.resize(2, board.corners());
  for (int i = 0; i < board.corners(); ++i) {
    const cv::Point2f place = places[static_cast<std::size_t>(i)];
    corners.place_px.col(i) << place.x, place.y;
  }
  return corners;
}

}  // namespace lens

// A camera that does not exist, in front of a chessboard that does not either.
//
// The picture is exact: a pixel is the board's brightness averaged over a Gaussian (lens and pixel together), which on
// the board is a Gaussian, too, since the projection is linear over so small a place. Along the one side of the squares
// the average is a difference of error functions; along the other it is summed piece by piece between the edges.
#pragma once

#include "lens/chessboard.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

namespace lens {

/// The truth, in words of its own: not sensor::Projection.
struct TrueCamera {
  int width = 640, height = 480;
  double aspect = 1.0;  // the focal length along v is aspect * focal
  double focal = 900.0, u0 = 319.5, v0 = 239.5, k1 = 0.0, k2 = 0.0;

  Eigen::Vector2d project(const Eigen::Vector3d& seen) const {
    const double x = seen.x() / seen.z(), y = seen.y() / seen.z(), r2 = x * x + y * y;
    const double stretch = 1.0 + k1 * r2 + k2 * r2 * r2;
    return {u0 + focal * stretch * x, v0 + aspect * focal * stretch * y};
  }

  /// Of the ray that is seen at a pixel: x / z, y / z.
  Eigen::Vector2d ray(double u, double v) const {
    const double x = (u - u0) / focal, y = (v - v0) / (aspect * focal), bent = std::hypot(x, y);
    double r = bent;
    for (int i = 0; i < 30; ++i) {
      const double r2 = r * r, step = (r * (1 + (k1 + k2 * r2) * r2) - bent) / (1 + (3 * k1 + 5 * k2 * r2) * r2);
      r -= step;
      if (std::abs(step) < 1e-14) break;
    }
    return bent > 0.0 ? Eigen::Vector2d(x * r / bent, y * r / bent) : Eigen::Vector2d(0.0, 0.0);
  }
};

/// seen = turn * (board point, z = 0) + shift.
struct BoardPose {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  Eigen::Vector3d shift = {0.0, 0.0, 0.3};
};

struct Shot {
  double dark = 30.0, bright = 200.0;  ///< levels
  double blur_px = 0.8;                ///< deviation of the Gaussian, the pixel's own width included
  double noise = 2.0;                  ///< levels
};

namespace drawing {

inline double below(double x) {
  return 0.5 * std::erfc(-x * std::numbers::sqrt2 / 2.0);
}

/// Whether the pattern along one side, of n squares from 0 on, is of the second kind at x; -1: beyond the board.
inline int kind(double x, int n) {
  return x < 0.0 || x >= n ? -1 : static_cast<int>(x) % 2;
}

/// Share of dark under a Gaussian across edges of one direction alone, in a row or column of the given kind.
inline double darkAcross(double at, double deviation, int squares, int otherKind) {
  double sum = 0.0;
  const int first = std::max(0, static_cast<int>(std::floor(at - 5.0 * deviation)));
  const int last = std::min(squares - 1, static_cast<int>(std::floor(at + 5.0 * deviation)));
  for (int i = first; i <= last; ++i) {
    if ((i + otherKind) % 2 == 0) sum += below((i + 1 - at) / deviation) - below((i - at) / deviation);
  }
  return sum;
}

/// Share of dark under a Gaussian of (x, y), sides of squares, deviations sx, sy and correlation.
inline double dark(double x, double y, double sx, double sy, double correlation, int columns, int rows) {
  constexpr double kReach = 5.0;
  // Along y, given x: normal with mean y + slope (X - x) and deviation rest.
  const double slope = correlation * sy / sx, rest = sy * std::sqrt(1.0 - correlation * correlation);
  const auto darkGiven = [&](double at, int kindX) { return darkAcross(y + slope * (at - x), rest, rows, kindX); };
  const double from = x - kReach * sx, to = x + kReach * sx;
  // Five points of Gauss and Legendre on each piece no longer than a deviation and a half.
  constexpr double kNode[5] = {-0.9061798459386640, -0.5384693101056831, 0.0, 0.5384693101056831, 0.9061798459386640};
  constexpr double kWeight[5] = {0.2369268850561891, 0.4786286704993665, 0.5688888888888889, 0.4786286704993665,
                                 0.2369268850561891};
  double sum = 0.0;
  for (double begin = from; begin < to;) {
    const double end = std::min({to, begin + 1.5 * sx, std::floor(begin) + 1.0});
    const int kindX = kind(0.5 * (begin + end), columns);
    if (kindX >= 0) {
      for (int i = 0; i < 5; ++i) {
        const double at = 0.5 * (begin + end) + 0.5 * (end - begin) * kNode[i], z = (at - x) / sx;
        sum += 0.5 * (end - begin) * kWeight[i] * std::exp(-0.5 * z * z) / (sx * std::sqrt(2 * std::numbers::pi)) *
               darkGiven(at, kindX);
      }
    }
    begin = end;
  }
  return sum;
}

}  // namespace drawing

/// Where the camera sees a point of the board [m].
inline Eigen::Vector2d seenAt(const TrueCamera& camera, const BoardPose& pose, const Eigen::Vector2d& onBoard) {
  return camera.project(pose.turn * Eigen::Vector3d(onBoard.x(), onBoard.y(), 0.0) + pose.shift);
}

/// The board's first inner corner is its point (0, 0).
inline cv::Mat photograph(const TrueCamera& camera, const Board& board, const BoardPose& pose, const Shot& shot,
                          std::mt19937& generator) {
  // From a ray to the board, in squares from its outer corner.
  Eigen::Matrix3d toRay;
  toRay << pose.turn.col(0), pose.turn.col(1), pose.shift;
  const Eigen::Matrix3d toBoard = toRay.inverse();
  const auto onBoard = [&](double u, double v) -> Eigen::Vector2d {
    const Eigen::Vector2d ray = camera.ray(u, v);
    const Eigen::Vector3d point = toBoard * Eigen::Vector3d(ray.x(), ray.y(), 1.0);
    return point.head<2>() / point.z() / board.square + Eigen::Vector2d(1.0, 1.0);
  };
  cv::Mat picture(camera.height, camera.width, CV_8UC1);
  std::normal_distribution<double> noise(0.0, shot.noise);
  std::vector<Eigen::Vector2d> above(static_cast<std::size_t>(camera.width)), line(above.size());
  for (int v = 0; v <= camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) line[static_cast<std::size_t>(u)] = onBoard(u, v);
    for (int u = 0; v > 0 && u < camera.width; ++u) {
      const auto i = static_cast<std::size_t>(u), next = std::min(i + 1, line.size() - 1), before = next - 1;
      const Eigen::Vector2d right = above[next] - above[before], down = line[i] - above[i];
      const double sx = shot.blur_px * std::hypot(right.x(), down.x()),
                   sy = shot.blur_px * std::hypot(right.y(), down.y());
      const double correlation =
          shot.blur_px * shot.blur_px * (right.x() * right.y() + down.x() * down.y()) / (sx * sy);
      const double x = above[i].x(), y = above[i].y();
      double dark = 0.0;
      const auto farFromEdge = [](double at, double deviation) {
        return std::abs(at - std::round(at)) > 5.0 * deviation;
      };
      if (farFromEdge(x, sx) && farFromEdge(y, sy)) {
        const int kind = drawing::kind(x, board.columns);
        dark = kind >= 0 && kind == drawing::kind(y, board.rows) ? 1.0 : 0.0;
      } else if (farFromEdge(x, sx)) {
        const int kind = drawing::kind(x, board.columns);
        dark = kind < 0 ? 0.0 : drawing::darkAcross(y, sy, board.rows, kind);
      } else if (farFromEdge(y, sy)) {
        const int kind = drawing::kind(y, board.rows);
        dark = kind < 0 ? 0.0 : drawing::darkAcross(x, sx, board.columns, kind);
      } else {
        dark = drawing::dark(x, y, sx, sy, std::clamp(correlation, -0.999, 0.999), board.columns, board.rows);
      }
      const double level = shot.bright + dark * (shot.dark - shot.bright) + noise(generator);
      picture.at<std::uint8_t>(v - 1, u) = static_cast<std::uint8_t>(std::clamp(std::lround(level), 0L, 255L));
    }
    above.swap(line);
  }
  return picture;
}

}  // namespace lens

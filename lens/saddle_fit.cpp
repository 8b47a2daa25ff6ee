#include "lens/saddle_fit.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

namespace lens {

namespace {

constexpr int kUnknowns = 7;  // corner u, v; two directions; level; step; blur
constexpr int kSteps = 15;
constexpr double kSettled_px = 1e-4;
constexpr double kFarthest_px = 1.5;  // from the start value

using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;

/// Direction and curvature of an edge near a corner, from the row of corners.
struct Edge {
  double angle = 0.0;      ///< direction [rad]
  double curvature = 0.0;  ///< towards the normal (-sin, cos) [1/px]
};

Edge edgeAt(const CornerGrid& grid, int x, int y, int side) {
  const cv::Point step(1 - side, side);
  // At the end of a row, the values of the corner beside it are used.
  const cv::Point at(side == 0 ? std::clamp(x, 1, grid.size.width - 2) : x,
                     side == 0 ? y : std::clamp(y, 1, grid.size.height - 2));
  const cv::Point2d before = grid.at(at.x - step.x, at.y - step.y), here = grid.at(at.x, at.y),
                    after = grid.at(at.x + step.x, at.y + step.y), chord = 0.5 * (after - before);
  const cv::Point2d way = chord / cv::norm(chord), normal(-way.y, way.x);
  return {std::atan2(way.y, way.x), normal.dot(after - 2.0 * here + before) / chord.dot(chord)};
}

/// Normal equations of the fit, and the sum of squared residuals.
struct Normal {
  Eigen::Matrix<double, kUnknowns, kUnknowns> matrix = Eigen::Matrix<double, kUnknowns, kUnknowns>::Zero();
  Unknowns right = Unknowns::Zero();
  double squares = 0.0;
};

Normal normalEquations(const cv::Mat& grey, const cv::Rect& window, cv::Point2d middle, double radius_px,
                       const std::array<Edge, 2>& edges, const Unknowns& x) {
  Normal normal;
  const double blur = x[6];
  for (int v = window.y; v < window.y + window.height; ++v) {
    for (int u = window.x; u < window.x + window.width; ++u) {
      if (std::hypot(u - middle.x, v - middle.y) > radius_px) continue;
      std::array<double, 2> value{}, slope{}, d{};
      std::array<double, 2> byU{}, byV{}, byAngle{};
      for (std::size_t k = 0; k < 2; ++k) {
        const double c = std::cos(x[2 + static_cast<int>(k)]), s = std::sin(x[2 + static_cast<int>(k)]);
        const double du = u - x[0], dv = v - x[1], along = c * du + s * dv, across = c * dv - s * du;
        const double bend = edges[k].curvature;
        d[k] = across - 0.5 * bend * along * along;
        value[k] = std::erf(d[k] / (blur * std::numbers::sqrt2));
        slope[k] = std::sqrt(2.0 / std::numbers::pi) / blur * std::exp(-0.5 * d[k] * d[k] / (blur * blur));
        byU[k] = s + bend * along * c;
        byV[k] = -c + bend * along * s;
        byAngle[k] = -along - bend * along * across;
      }
      const double first = x[5] * slope[0] * value[1], second = x[5] * value[0] * slope[1];
      Unknowns row;
      row << first * byU[0] + second * byU[1], first * byV[0] + second * byV[1], first * byAngle[0],
          second * byAngle[1], 1.0, value[0] * value[1], -(first * d[0] + second * d[1]) / blur;
      const double off = grey.at<std::uint8_t>(v, u) - x[4] - x[5] * value[0] * value[1];
      normal.matrix += row * row.transpose();
      normal.right += row * off;
      normal.squares += off * off;
    }
  }
  return normal;
}

std::optional<cv::Point2f> fitted(const cv::Mat& grey, cv::Point2d start, double radius_px, double blur_px,
                                  const std::array<Edge, 2>& edges) {
  const int reach = static_cast<int>(std::ceil(radius_px));
  const cv::Rect window(static_cast<int>(std::lround(start.x)) - reach, static_cast<int>(std::lround(start.y)) - reach,
                        2 * reach + 1, 2 * reach + 1);
  if ((window & cv::Rect(0, 0, grey.cols, grey.rows)) != window) return std::nullopt;
  Unknowns x;
  x << start.x, start.y, edges[0].angle, edges[1].angle, 0.0, 0.0, blur_px;
  // Level and step are linear: they are solved for first, with the other unknowns held.
  const Normal first = normalEquations(grey, window, start, radius_px, edges, x);
  x.segment<2>(4) = first.matrix.block<2, 2>(4, 4).ldlt().solve(first.right.segment<2>(4));
  for (int i = 0; i < kSteps; ++i) {
    const Normal normal = normalEquations(grey, window, start, radius_px, edges, x);
    const Unknowns step = normal.matrix.ldlt().solve(normal.right);
    if (!step.allFinite()) return std::nullopt;
    x += step;
    if (!(x[6] > 0.1) || std::hypot(x[0] - start.x, x[1] - start.y) > kFarthest_px) return std::nullopt;
    if (step.head<2>().norm() < kSettled_px) return cv::Point2f(cv::Point2d(x[0], x[1]));
  }
  return std::nullopt;
}

}  // namespace

void fitSaddles(const cv::Mat& grey, double radius_px, double blur_px, CornerGrid& grid) {
  const CornerGrid start = grid;
  for (int y = 0; y < grid.size.height; ++y) {
    for (int x = 0; x < grid.size.width; ++x) {
      const std::array<Edge, 2> edges = {edgeAt(start, x, y, 0), edgeAt(start, x, y, 1)};
      const auto place = fitted(grey, start.at(x, y), radius_px, blur_px, edges);
      if (place) grid.places[static_cast<std::size_t>(y * grid.size.width + x)] = *place;
    }
  }
}

}  // namespace lens

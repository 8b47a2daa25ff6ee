#include "sensor/elastic/surface.h"

#include <cmath>
#include <numbers>

namespace sensor::elastic {

namespace {

/// Returns x ln(y + r), r = |(x, y)|, without cancellation for negative y.
double lineTerm(double x, double y) {
  if (x == 0.0) return 0.0;
  const double r = std::hypot(x, y);
  return x * std::log(y >= 0.0 ? y + r : x * x / (r - y));
}

/// Second antiderivatives, over x and y, of the terms of the surface fields.
struct Potentials {
  double xx;  ///< of x^2 / r^3; with yy, of 1 / r
  double yy;  ///< of y^2 / r^3
  double xy;  ///< of x y / r^3
  double x;   ///< of x / r^2
  double y;   ///< of y / r^2
};

/// Returns the second antiderivative of a / r^2.
double slopeTerm(double a, double b) {
  const double r = std::hypot(a, b);
  return (b == 0.0 ? 0.0 : b * std::log(r)) + (a == 0.0 ? 0.0 : a * std::atan(b / a));
}

Potentials potentialsAt(double x, double y) {
  return {
      .xx = lineTerm(y, x), .yy = lineTerm(x, y), .xy = -std::hypot(x, y), .x = slopeTerm(x, y), .y = slopeTerm(y, x)};
}

}  // namespace

Eigen::Matrix3d halfSpaceSquare(const Eigen::Vector2d& offset, double side, double youngsModulus, double poissonRatio) {
  double xx = 0.0, yy = 0.0, xy = 0.0, x = 0.0, y = 0.0;
  for (const int right : {-1, 1}) {
    for (const int upper : {-1, 1}) {
      const Potentials corner = potentialsAt(offset.x() + 0.5 * right * side, offset.y() + 0.5 * upper * side);
      const double sign = right * upper;
      xx += sign * corner.xx;
      yy += sign * corner.yy;
      xy += sign * corner.xy;
      x += sign * corner.x;
      y += sign * corner.y;
    }
  }
  const double shear = youngsModulus / (2.0 * (1.0 + poissonRatio));
  const double nu = poissonRatio, stretch = 2.0 * (1.0 - nu), slide = 2.0 * nu, tilt = 1.0 - 2.0 * nu;
  Eigen::Matrix3d u;                                             // one column per force
  u << stretch * (xx + yy) + slide * xx, slide * xy, -tilt * x,  //
      slide * xy, stretch * (xx + yy) + slide * yy, -tilt * y,   //
      tilt * x, tilt * y, stretch * (xx + yy);
  return u / (4.0 * std::numbers::pi * shear * side * side);
}

Eigen::MatrixXd surfaceMatrix(const Gel& gel, const Points& nodes, double pitch, const Progress& progress) {
  const BlockOptions options{.clearance = clearanceOf(gel, nodes)};
  Eigen::MatrixXd u = BlockCorrection(gel, nodes, options, progress).matrix(nodes);
  for (Eigen::Index s = 0; s < nodes.cols(); ++s) {
    for (Eigen::Index t = 0; t < nodes.cols(); ++t) {
      const Eigen::Vector2d offset = (nodes.col(t) - nodes.col(s)).head<2>();
      u.block<3, 3>(3 * t, 3 * s) += halfSpaceSquare(offset, pitch, gel.youngsModulus, gel.poissonRatio);
    }
  }
  return u;
}

}  // namespace sensor::elastic

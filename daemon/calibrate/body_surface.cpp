#include "daemon/calibrate/body_surface.h"

#include "sensor/elastic/loads.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace tractiond::calibrate {

namespace {

constexpr double kLeastRoom = 1.05;  // of the spread of a force on a node: less has no effect
constexpr double kHertz = 5.0;    // squared radius of Hertz's pressure over its mean squared distance from a diameter
constexpr double kSquare = 12.0;  // the same of an even pressure on a square, of its side

/// Returns the coefficients of a cubic spline with knots 0, 1 ... count - 1 that has given values there and no
/// curvature at its ends: (count + 2) x count.
Eigen::MatrixXd splineOf(int count) {
  Eigen::MatrixXd values = Eigen::MatrixXd::Zero(count + 2, count + 2);
  for (int i = 0; i < count; ++i) values.block<1, 3>(i + 1, i) << 1.0 / 6, 4.0 / 6, 1.0 / 6;
  values.topLeftCorner<1, 3>() << 1, -2, 1;
  values.bottomRightCorner<1, 3>() << 1, -2, 1;
  return values.inverse().middleCols(1, count);
}

/// Returns the weights (first column) of the values at the knots for a place between the first and the last, and their
/// derivatives.
Eigen::Matrix<double, Eigen::Dynamic, 2> weightsAt(const Eigen::MatrixXd& spline, double place) {
  const auto count = static_cast<int>(spline.cols());
  const double within = std::clamp(place, 0.0, count - 1.0);
  const int first = std::min(static_cast<int>(within), count - 2);
  const double t = within - first, s = 1 - t;
  Eigen::Matrix<double, 4, 2> basis;
  basis << s * s * s / 6, -s * s / 2,                          //
      (4 - 6 * t * t + 3 * t * t * t) / 6, t * (1.5 * t - 2),  //
      (4 - 6 * s * s + 3 * s * s * s) / 6, s * (2 - 1.5 * s),  //
      t * t * t / 6, t * t / 2;
  return spline.middleRows<4>(first).transpose() * basis;
}

}  // namespace

/// A place on the surface.
struct BodySurface::Spot {
  Eigen::MatrixXd shares;  ///< columns x rows
  Eigen::Vector3d place;
  Eigen::Matrix<double, 3, 2> slope;  ///< of the place by the coordinates
};

BodySurface::BodySurface(const sensor::Sensor& sensor)
    : columns_(sensor.nodes.columns)
    , rows_(sensor.nodes.rows)
    , pitch_(sensor.nodes.pitch)
    , spread_(pitch_ * std::sqrt(kHertz / kSquare))
    , nodes_(sensor::nodePositions(sensor))
    , normals_(sensor::nodeNormals(sensor))
    , ofColumns_(splineOf(columns_))
    , ofRows_(splineOf(rows_)) {
  assert(sensor.body && columns_ >= kFewest && rows_ >= kFewest);
}

BodySurface::Spot BodySurface::at(const Eigen::Vector2d& place) const {
  const Eigen::Matrix<double, Eigen::Dynamic, 2> across =
      weightsAt(ofColumns_, place.x() / pitch_ + 0.5 * (columns_ - 1));
  const Eigen::Matrix<double, Eigen::Dynamic, 2> along = weightsAt(ofRows_, place.y() / pitch_ + 0.5 * (rows_ - 1));
  const auto sum = [this](const Eigen::MatrixXd& weights) -> Eigen::Vector3d { return nodes_ * weights.reshaped(); };
  Spot spot;
  spot.shares = across.col(0) * along.col(0).transpose();
  spot.place = sum(spot.shares);
  spot.slope << sum(across.col(1) * along.col(0).transpose()) / pitch_,
      sum(across.col(0) * along.col(1).transpose()) / pitch_;
  return spot;
}

BodySurface::Patch BodySurface::patch(const Eigen::Vector3d& shape) const {
  const Spot centre = at(shape.head<2>());
  Patch patch;
  patch.place = centre.place;
  patch.normal = (normals_ * centre.shares.reshaped()).normalized();
  // Lengths in the plane that touches the surface here, as coordinates.
  const Eigen::Vector3d across = centre.slope.col(0).normalized();
  Eigen::Matrix<double, 3, 2> plane;
  plane << across, patch.normal.cross(across).normalized();
  const Eigen::Matrix2d ofPlane = (plane.transpose() * centre.slope).inverse();
  // A force on a node is spread already, so the contact is divided as a narrower one.
  const double radius = std::sqrt(std::max(shape.z() * shape.z() - spread_ * spread_, 0.0));
  const auto points = sensor::elastic::hertz(Eigen::Vector2d::Zero(), std::max(radius, 1e-6), Eigen::Vector3d::UnitZ());
  Eigen::MatrixXd shares = Eigen::MatrixXd::Zero(columns_, rows_);
  for (Eigen::Index i = 0; i < points.points.cols(); ++i) {
    const Eigen::Vector2d place = shape.head<2>() + ofPlane * points.points.col(i).head<2>();
    shares += points.forces(2, i) * at(place).shares;
  }
  patch.shares = shares.reshaped();
  return patch;
}

Eigen::Vector3d BodySurface::bounded(const Eigen::Vector3d& shape) const {
  const Eigen::Vector2d half = 0.5 * pitch_ * Eigen::Vector2d(columns_ - 1, rows_ - 1);
  const double radius = std::clamp(shape.z(), kLeastRoom * spread_, std::max(0.5 * half.minCoeff(), 2.0 * spread_));
  const Eigen::Vector2d room = (half.array() - radius).max(0.0);
  const Eigen::Vector2d place = shape.head<2>().cwiseMax(-room).cwiseMin(room);
  return {place.x(), place.y(), radius};
}

Eigen::Vector2d BodySurface::nearest(const Eigen::Vector2d& place) const {
  Eigen::Index node = 0;
  (nodes_.topRows<2>().colwise() - place).colwise().squaredNorm().minCoeff(&node);
  const Eigen::Index column = node % columns_, row = node / columns_;
  return pitch_ * (Eigen::Vector2d(static_cast<double>(column), static_cast<double>(row)) -
                   0.5 * Eigen::Vector2d(columns_ - 1, rows_ - 1));
}

}  // namespace tractiond::calibrate

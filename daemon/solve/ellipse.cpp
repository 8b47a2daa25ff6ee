#include "daemon/solve/ellipse.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tractiond::solve {
namespace {

/// Deviation of an angle of which nothing is known: it is uniform over half a turn.
const double kAnyAngle = std::numbers::pi / std::sqrt(12.0);

}  // namespace

Ellipse::Ellipse(const Eigen::Matrix2d& all, double least) {
  const double mean = 0.5 * all.trace(), difference = 0.5 * (all(0, 0) - all(1, 1)), across = all(0, 1);
  const double apart = std::hypot(difference, across), angle = 0.5 * std::atan2(across, difference);
  moments = Eigen::Vector2d(mean + apart, mean - apart).cwiseMax(least);
  axes << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
}

Eigen::Vector3d Ellipse::unit(const Eigen::Vector2d& away) const {
  const Eigen::Vector2d along = axes.transpose() * away;
  return {along.x() * along.x(), along.y() * along.y(), along.x() * along.y()};
}

void setShape(const Ellipse& ellipse, const Eigen::Matrix4d& covariance, Contact& contact) {
  const auto deviation = [&](const Eigen::Vector4d& by) { return std::sqrt(std::max(0.0, by.dot(covariance * by))); };
  contact.areaDeviation_m2 = deviation(Eigen::Vector4d::Unit(0));
  const Eigen::Vector4d ofRadius(0.5 / contact.area_m2, 0.0, 0.0, 0.0);
  const Eigen::Vector4d ofRatio(0.0, 0.25 / ellipse.moments[0], -0.25 / ellipse.moments[1], 0.0);
  const double radius = std::sqrt(contact.area_m2 / std::numbers::pi);
  const double ratio = std::pow(ellipse.moments[0] / ellipse.moments[1], 0.25);
  contact.halfAxes_m = {radius * ratio, radius / ratio};
  contact.halfAxesDeviation_m = {radius * ratio * deviation(ofRadius + ofRatio),
                                 radius / ratio * deviation(ofRadius - ofRatio)};
  contact.orientation_rad = std::atan2(ellipse.axes(1, 0), ellipse.axes(0, 0));
  if (contact.orientation_rad >= std::numbers::pi / 2.0) contact.orientation_rad -= std::numbers::pi;
  const double apart = ellipse.moments[0] - ellipse.moments[1], turn = deviation(Eigen::Vector4d::Unit(3));
  contact.orientationDeviation_rad = turn < kAnyAngle * apart ? turn / apart : kAnyAngle;
}

}  // namespace tractiond::solve

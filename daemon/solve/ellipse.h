// The half axes of a contact: of the ellipse of an even pressure with the area of the contact, and with the ratio and
// direction of the second moments of its forces (docs/mathematics.md, 4.7).
#pragma once

#include "daemon/records/traction_field.h"

#include <Eigen/Core>

namespace tractiond::solve {

/// Second moments of forces about their centre, by their principal axes.
struct Ellipse {
  /// \param all moments [m^2]
  /// \param least value of each [m^2], above 0: what is narrower cannot be resolved
  Ellipse(const Eigen::Matrix2d& all, double least);

  Eigen::Vector2d moments;  ///< the larger one first
  Eigen::Matrix2d axes;     ///< unit vectors, likewise, column by column

  /// Numbers whose covariance setShape() needs: area, moments along the larger axis, along the other, across both.
  static constexpr int kNumbers = 4;
  /// Returns the second moments of a unit force at a place relative to the centre, in this order but without the area.
  Eigen::Vector3d unit(const Eigen::Vector2d& away) const;
};

/// Sets half axes and orientation of a contact whose area is set, with their deviations; the area's as well.
/// \param covariance of Ellipse::kNumbers
void setShape(const Ellipse& ellipse, const Eigen::Matrix4d& covariance, Contact& contact);

}  // namespace tractiond::solve

// Measures one weight on the gel: its place, and its force under the assumed elasticity.
#pragma once

#include "daemon/calibrate/body_surface.h"
#include "daemon/calibrate/picture_motion.h"
#include "sensor/elastic/block.h"

#include <optional>

namespace tractiond::calibrate {

/// The contact that explains the markers' displacements best, with the Young's modulus of the gel file.
struct ContactReading {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();       ///< on the gel, gel frame, z into the gel [N]
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< [N^2], by the variances, or the scatter if larger
  Eigen::Vector3d place = Eigen::Vector3d::Zero();       ///< of its centre on the touched surface, gel frame [m]
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();     ///< of the surface there, into the gel
  double radius = 0.0;                                   ///< of a Hertz contact that is as broad [m]
  Eigen::Vector3d shape = Eigen::Vector3d::Zero();       ///< place and radius, as for ContactFit::fields()
  Eigen::Vector3d along = Eigen::Vector3d::UnitZ();      ///< direction in which the force is known: set by the caller
  double residual_px = 0.0;                              ///< root mean square over the valid coordinates
  double expected_px = 0.0;                              ///< expected residual by noise alone
};

/// Displacements as the equations of a weighted fit: rows are coordinates, u and v marker after marker.
struct Observed {
  Eigen::VectorXd value_px, weight;  ///< 2 M; the weight is 1 / variance [1/px^2]; both 0 where a marker is ignored
  Eigen::Matrix<double, Eigen::Dynamic, 4> byMotion;  ///< 2 M x 4, by PictureMotion::value
  Eigen::Vector4d motionWeight;                       ///< 1 / variance of PictureMotion::value
  double coordinates = 0;                             ///< number of those that are not ignored
};

/// Converts displacements and their variances, as ContactFit takes them, into the equations of a weighted fit. Ignores
/// a marker that is not valid or whose variance is not above 0.
/// \param seen gives camera and picture motion. Reentrant.
Observed observe(const sensor::Sensor& seen, const Displacements& displacements, std::span<const float> variance_px2);

/// Fits one round contact on a block or a body: no regularisation, so that its force carries no bias.
///   minimise over place, radius, force f, picture motion m
///     sum over markers |d - J (U(place, radius) f) - M m|^2 / variance + sum (m / its deviation)^2
/// Gauss-Newton over place and radius, the rest is linear. Reentrant; immutable after construction.
class ContactFit {
 public:
  /// Computes the mechanics of a block: takes seconds on all cores. A body has those of its influence file, and at
  /// least BodySurface::kFewest columns and rows of nodes (asserted). Later calls may use another camera pose than the
  /// sensor's. The sensor is copied.
  explicit ContactFit(const sensor::Sensor& sensor);

  /// Fits the contact, with a radius limited to 0.5 to 15 mm and within the sides of a block; for a body see
  /// BodySurface::bounded(). Returns nothing if fewer than ten markers are valid and not ignored, or the fit fails. A
  /// poor fit is returned: then residual_px is far above expected_px.
  /// \param seen the sensor with the camera through which the displacements are seen, and the deviations of the
  /// picture's motion
  /// \param variance_px2 M, variance of each of a marker's coordinates; not above 0: the marker is ignored
  std::optional<ContactReading> operator()(const sensor::Sensor& seen, const Displacements& displacements,
                                           std::span<const float> variance_px2) const;

  /// Returns the displacements of all markers by unit forces along x, y, z on a contact, without motion of the picture,
  /// 2 M x 3 [px/N].
  /// \param shape x, y, radius [m]; of a body as for BodySurface::patch()
  /// \param deeper depth of the markers of a block beyond that of the gel file [m]
  Eigen::MatrixXd fields(const sensor::Camera& camera, const Eigen::Vector3d& shape, double deeper = 0.0) const {
    return unitFields(sensor::Projection(camera, sensor_.gel.size.z()), shape, false, deeper);
  }

  /// Returns the change of fields() by one standard deviation of a quantity of the body.
  /// \param number index into sensor::Body::errors
  Eigen::MatrixXd fieldErrors(const sensor::Camera& camera, const Eigen::Vector3d& shape, std::size_t number) const;

 private:
  struct Trial;
  struct Normal;
  Trial at(const sensor::Projection& projection, const Observed& observed, const Eigen::Vector3d& shape,
           bool roughly) const;
  Trial first(const sensor::Projection& projection, const Observed& observed, const Eigen::Vector2d& about) const;
  Normal about(const sensor::Projection& projection, const Observed& observed, const Trial& trial) const;
  Eigen::Vector3d bounded(const Eigen::Vector3d& shape) const;
  /// As fields().
  /// \param roughly true: computes the correction for the block's sides and base as that of a point force
  Eigen::MatrixXd unitFields(const sensor::Projection& projection, const Eigen::Vector3d& shape, bool roughly,
                             double deeper = 0.0) const;
  /// Returns the same of a body whose influence is this one.
  Eigen::MatrixXd bodyFields(const sensor::Projection& projection, const Eigen::Vector3d& shape,
                             const Eigen::MatrixXd& influence) const;

  sensor::Sensor sensor_;
  sensor::Points markers_;
  std::optional<sensor::elastic::BlockCorrection> correction_;  ///< of a block only
  std::optional<BodySurface> surface_;                          ///< of a body only
};

}  // namespace tractiond::calibrate

// Measures one weight on the gel: its place, and its force under the assumed elasticity.
#pragma once

#include "daemon/calibrate/picture_motion.h"
#include "sensor/elastic/block.h"

#include <optional>

namespace tractiond::calibrate {

/// The contact that explains the markers' displacements best, with the Young's modulus of the gel file.
struct ContactReading {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();       ///< on the gel, gel frame, z into the gel [N]
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< [N^2], by the scatter of the residual
  Eigen::Vector2d place = Eigen::Vector2d::Zero();       ///< of its centre, gel frame [m]
  double radius = 0.0;                                   ///< of a Hertz contact that is as broad [m]
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

/// Parameters are those of ContactFit. Reentrant.
Observed observe(const sensor::Sensor& sensor, const sensor::Camera& camera, const sensor::PictureMotion& motion,
                 const Displacements& displacements, std::span<const float> variance_px2);

/// Fits one round contact in the block: no regularisation, so that its force carries no bias.
///   minimise over place, radius, force f, picture motion m
///     sum over markers |d - J (U(place, radius) f) - M m|^2 / variance + sum (m / its deviation)^2
/// Gauss-Newton over place and radius, the rest is linear. Reentrant; immutable after construction.
class ContactFit {
 public:
  /// Computes the gel's mechanics: takes seconds on all cores. The sensor must be a block. Later calls may
  /// use another camera pose than the sensor's. The sensor is copied. \param progress called meanwhile; may be empty
  explicit ContactFit(const sensor::Sensor& sensor, const sensor::elastic::Progress& progress = {});

  /// Fits the contact, with a radius limited to 0.5 to 15 mm and within the sides of the gel. Returns nothing if fewer
  /// than ten markers are valid and not ignored, or the fit fails. A poor fit is returned: then residual_px is far
  /// above expected_px. \param camera through which the displacements are seen \param motion deviations of the
  /// picture's motion \param variance_px2 M, variance of each of a marker's coordinates; not above 0: the marker is
  /// ignored
  std::optional<ContactReading> operator()(const sensor::Camera& camera, const sensor::PictureMotion& motion,
                                           const Displacements& displacements,
                                           std::span<const float> variance_px2) const;

  /// Returns the displacements of all markers by unit forces along x, y, z on a contact, without motion of the picture,
  /// 2 M x 3 [px/N]. \param shape x, y, radius [m]
  /// \param deeper depth of the markers beyond that of the gel file [m]
  Eigen::MatrixXd fields(const sensor::Camera& camera, const Eigen::Vector3d& shape, double deeper = 0.0) const {
    return unitFields(sensor::Projection(camera, sensor_.gel.size.z()), shape, false, deeper);
  }

 private:
  struct Trial;
  struct Normal;
  Trial at(const sensor::Projection& projection, const Observed& observed, const Eigen::Vector3d& shape,
           bool roughly) const;
  Trial first(const sensor::Projection& projection, const Observed& observed, const Eigen::Vector2d& about) const;
  Normal about(const sensor::Projection& projection, const Observed& observed, const Trial& trial) const;
  Eigen::Vector3d bounded(const Eigen::Vector3d& shape) const;
  /// As fields(). \param roughly true: computes the correction for the block's sides and base as that of a point force
  Eigen::MatrixXd unitFields(const sensor::Projection& projection, const Eigen::Vector3d& shape, bool roughly,
                             double deeper = 0.0) const;

  sensor::Sensor sensor_;
  sensor::Points markers_;
  sensor::elastic::BlockCorrection correction_;
};

}  // namespace tractiond::calibrate

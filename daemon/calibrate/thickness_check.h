// Checks the block's thickness against the gel file, and tells what a weight does not show. The rest picture does not
// show the thickness, but the pattern of displacements under a weight does: a thinner block moves less at a distance
// from the contact.
#pragma once

#include "daemon/calibrate/contact_fit.h"

#include <optional>

namespace tractiond::calibrate {

struct ThicknessReading {
  double thickness = 0.0;  ///< by the pattern of displacements [m]
  double deviation = 0.0;  ///< of it against the file's: noise, what the file says of Poisson's ratio, depths and the
                           ///< thickness itself [m]
  double alarm = 5.0;      ///< deviations

  /// Returns whether the reading differs from an expected thickness [m] by more than `alarm` deviations.
  bool contradicts(double expected) const {
    return thickness - expected > alarm * deviation || expected - thickness > alarm * deviation;
  }
};

/// Adds a linear unknown to those of ContactFit, the effect of the thickness on the displacements, and nuisance
/// parameters for Poisson's ratio and each layer's depth with the file's deviations. Reentrant; immutable after
/// construction.
class ThicknessCheck {
 public:
  /// Takes twice as long as making a ContactFit, and no time for a body. `fit` must be of the same sensor and must
  /// outlive this; the sensor need not.
  ThicknessCheck(const sensor::Sensor& sensor, const ContactFit& fit);

  /// Estimates the thickness; parameters are those of ContactFit. Returns nothing if the displacements do not determine
  /// it at all, and for a body; else see `deviation`.
  /// \param reading that of ContactFit for the same displacements
  std::optional<ThicknessReading> operator()(const sensor::Sensor& seen, const Displacements& displacements,
                                             std::span<const float> variance_px2, const ContactReading& reading) const;

  /// Returns the relative deviation of a Young's modulus that this weight gives, by what is uncertain of thickness,
  /// Poisson's ratio and depths of a block, or of a body's sensor::Body::errors, of the camera and the mechanics: the
  /// modulus takes up how these misread the weight, so that later presses are read right, but it is not the material's.
  /// Requires that `reading.along` is set and that the force along it is not 0.
  /// \param seen gives the deviations of thickness, camera and mechanics; the constructor's sensor gives the others
  double absorbed(const sensor::Sensor& seen, const Displacements& displacements, std::span<const float> variance_px2,
                  const ContactReading& reading) const;

 private:
  static constexpr Eigen::Index kOfLoad = 10;  ///< unknowns of a load: force, place and radius, motion of the picture
  /// A load, and the displacements about it.
  struct Load {
    Eigen::Vector3d shape, force;
    Eigen::MatrixXd columns;                            ///< by its unknowns
    Eigen::VectorXd expected, residual, weight, prior;  ///< residual: 0 where a marker is ignored
  };
  Load loadOf(const sensor::Sensor& seen, const Displacements& displacements, std::span<const float> variance_px2,
              const ContactReading& reading) const;
  /// Returns the changes of the displacements by one deviation of Poisson's ratio and of each layer's depth; of a body
  /// by those of its errors.
  Eigen::MatrixXd byElasticity(const sensor::Camera& camera, const Load& load) const;
  Eigen::VectorXd byThickness(const sensor::Camera& camera, const Load& load) const;

  sensor::Sensor sensor_;
  const ContactFit& fit_;
  std::optional<ContactFit> thinner_, softer_;  ///< of a thinner block, of one with another Poisson's ratio
};

}  // namespace tractiond::calibrate

// Is the block as thick as the gel file says? The rest picture does not show it; the pattern of displacements under a
// weight does: a thinner block moves less far away from the contact.
#pragma once

#include "daemon/calibrate/contact_fit.h"

#include <optional>

namespace tractiond::calibrate {

struct ThicknessReading {
  double thickness = 0.0;  ///< by the pattern [m]
  double deviation = 0.0;  ///< of it against the file's: noise, what the file says of Poisson's ratio, depths and the
                           ///< thickness itself [m]
  double alarm = 5.0;      ///< deviations

  bool contradicts(double expected) const {
    return thickness - expected > alarm * deviation || expected - thickness > alarm * deviation;
  }
};

/// One more linear unknown beside those of ContactFit: what a change of the thickness does to the displacements, with
/// nuisances for Poisson's ratio and each layer's depth, which the file's deviations hold. Reentrant; immutable after
/// construction.
class ThicknessCheck {
 public:
  /// Twice the work of a ContactFit. `fit` is of the same sensor, and outlives this.
  ThicknessCheck(const sensor::Sensor& sensor, const ContactFit& fit, const sensor::elastic::Progress& progress = {});

  /// As ContactFit, whose reading of the same displacements is given. Nothing where they say nothing of the thickness.
  std::optional<ThicknessReading> operator()(const sensor::Camera& camera, const sensor::PictureMotion& motion,
                                             const Displacements& displacements, std::span<const float> variance_px2,
                                             const ContactReading& reading) const;

 private:
  sensor::Sensor sensor_;
  const ContactFit& fit_;
  ContactFit thinner_, softer_;  ///< of a thinner block, of one with another Poisson's ratio
};

}  // namespace tractiond::calibrate

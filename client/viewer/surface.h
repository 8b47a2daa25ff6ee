// Displacement of the touched surface under the forces of a field.
#pragma once

#include "traction/description.h"

#include <Eigen/Core>

#include <memory>

namespace traction::view {

/// Thread-bound. At first the surface moves as that of a half space, within a tenth of a second; once the gel's matrix
/// has been computed, in some seconds on a thread of its own, or read, as that of the gel. The matrix is shared by all
/// surfaces of the process, and kept in the user's cache: $XDG_CACHE_HOME/traction, or ~/.cache/traction.
class Surface {
 public:
  Surface();
  /// Stops the computation that may be running, and waits for its thread, unless another surface has the same gel.
  ~Surface();
  Surface(const Surface&) = delete;
  Surface& operator=(const Surface&) = delete;

  /// Sets the sensor whose fields follow. Returns at once if gel and nodes are those of the description before.
  /// Otherwise ends the one before, as the destructor, and starts to compute the new matrix if no other surface has.
  void describe(const Description& description);

  /// Returns the surface's displacement at the nodes under the field's forces [mm], 3 N: x, y, z of each node, in the
  /// order of Field::force_N. Does not check Field::valid. The result is valid until the next call. Returns nullptr
  /// - before describe(), and for a tenth of a second after it,
  /// - for a sensor that is a body, has more than 2,000 nodes or one within 1 mm of the gel's sides, or a gel of
  ///   implausible size or stiffness,
  /// - if the field does not have one force per node.
  const Eigen::VectorXf* displacement(const Field& field);

  /// Returns how much of the gel's matrix had been computed for the last displacement(): below 1 that was a half
  /// space's.
  float share() const { return share_; }

 private:
  struct Work;

  std::shared_ptr<Work> work_;  ///< for the gel described last; nullptr: it has no surface here
  double modulus_Pa_ = 1.0;     ///< of that gel
  float share_ = 0.0F;
  Eigen::VectorXf moved_;  ///< the result of displacement() [mm]
};

}  // namespace traction::view

// Displacement of the touched surface under the forces of a field.
#pragma once

#include "traction/description.h"

#include <Eigen/Core>

#include <memory>

namespace traction::view {

/// Thread-bound. Starts a thread of its own for each new gel, which computes the gel's matrix in some seconds.
class Surface {
 public:
  Surface();
  /// Stops the computation that may be running, and waits for its thread.
  ~Surface();
  Surface(const Surface&) = delete;
  Surface& operator=(const Surface&) = delete;

  /// Sets the sensor whose fields follow. Returns at once if gel and nodes are those of the description before.
  /// Otherwise stops a computation that still runs, waits for its end, and starts to compute the new matrix.
  void describe(const Description& description);

  /// Returns the surface's displacement at the nodes under the field's forces [mm], 3 N: x, y, z of each node, in the
  /// order of Field::force_N. Does not check Field::valid. The result is valid until the next call. Returns nullptr
  /// - before describe(), and while the matrix is being computed,
  /// - for a sensor that is a body, has more than 2,000 nodes or one within 1 mm of the gel's sides, or a gel of
  ///   implausible size or stiffness,
  /// - if the field does not have one force per node.
  const Eigen::VectorXf* displacement(const Field& field);

 private:
  struct Work;

  std::unique_ptr<Work> work_;  ///< for the gel described last; nullptr: it has no surface here
  Eigen::VectorXf moved_;       ///< the result of displacement() [mm]
};

}  // namespace traction::view

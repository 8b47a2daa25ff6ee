// The touched surface as the forces deform it.
#pragma once

#include "traction/description.h"

#include <Eigen/Core>

#include <memory>

namespace traction::view {

/// Thread-bound. What takes seconds for a gel that is new is done by a thread of its own.
class Surface {
 public:
  Surface();
  ~Surface();
  Surface(const Surface&) = delete;
  Surface& operator=(const Surface&) = delete;

  void describe(const Description& description);

  /// Of the face at node after node: x, y, z [mm]. Null: it is not known, not yet or for this body. Until the next
  /// call.
  const Eigen::VectorXf* displacement(const Field& field);

 private:
  struct Work;

  std::unique_ptr<Work> work_;  ///< of the gel described last; none: of no block
  Eigen::VectorXf moved_;
};

}  // namespace traction::view

// How the markers of the real block move under the contacts of a scenario.
#pragma once

#include "sensor/elastic/block.h"
#include "twin/patch_field.h"
#include "twin/scenario.h"

#include <filesystem>
#include <memory>
#include <span>
#include <vector>

namespace twin {

/// u = half-space field of each continuous patch + correction of the block. The correction varies slowly with the place
/// of the load, so it is computed at Chebyshev points of the region that a contact visits and interpolated from there.
/// Thread-bound.
class GelModel {
 public:
  /// Takes seconds, or reads what it computed before from `cache` (empty: no cache). Starts the BLAS's threads.
  GelModel(const sensor::Sensor& sensor, const std::vector<Contact>& contacts, const std::filesystem::path& cache = {},
           const sensor::elastic::Progress& progress = {});

  /// Displacements of all markers, 3 x count [m], with contact i in states[i]. Valid until the next call.
  const sensor::Points& displacement(std::span<const ContactState> states);

 private:
  struct Patch {
    PatchField field;
    // Of a unit load, around the patch's centre.
    Eigen::Matrix2Xd points;
    Eigen::VectorXd pressed;   ///< share of the force at each point
    Eigen::Matrix2Xd turning;  ///< forces of a unit torque
    Eigen::VectorXd nodesX, nodesY;
    Eigen::Index firstColumn;  ///< in correction_; then node after node, x fastest, three directions each
  };

  void add(const Patch& patch, const ContactState& state);

  sensor::Points markers_;
  std::vector<std::size_t> depthIndex_;  ///< of each marker
  std::vector<Patch> patches_;
  Eigen::MatrixXd correction_;  ///< 3 markers x 3 nodes of all patches [m/N]
  std::vector<ContactState> states_;
  Eigen::VectorXd loads_;
  sensor::Points displacement_;
};

}  // namespace twin

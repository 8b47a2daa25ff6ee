// Computes the motion of the block's markers under the contacts of a scenario.
#pragma once

#include "sensor/elastic/block.h"
#include "sensor/elastic/loads.h"
#include "twin/scenario.h"

#include <filesystem>
#include <memory>
#include <span>
#include <vector>

namespace twin {

/// Displacement per unit load: columns are 1 N along x, y, z [m/N] and 1 N m about z [m/(N m)].
using UnitResponse = Eigen::Matrix<double, 3, 4>;

/// The field of the half-space under a patch of one shape and size, at fixed depths: fast enough for every marker of
/// every frame. A patch is round, so its response rotates with the direction to the point, and a table over the
/// distance suffices. Immutable after construction and reentrant.
class PatchField {
 public:
  /// \param pressed, turned the patch at the origin, under 1 N along z and under 1 N m
  /// \param depths z of the points to be evaluated [m]
  /// \param farthest largest distance of these points from the patch's axis [m]
  PatchField(const sensor::Gel& gel, const sensor::elastic::PatchQuadrature& pressed,
             const sensor::elastic::PatchQuadrature& turned, const std::vector<double>& depths, double farthest);

  /// Returns the response at depths[depth], at `offset` (x, y) [m] from the patch's centre, to 1e-5 of the peak.
  /// Offsets longer than `farthest` are not checked.
  UnitResponse at(std::size_t depth, const Eigen::Vector2d& offset) const;

 private:
  std::vector<std::vector<UnitResponse>> tables_;  ///< per depth: responses on the x axis at multiples of a fixed step
};

/// u = half-space field of each continuous patch + correction of the block. The correction varies slowly with the
/// position of the load, so it is computed at Chebyshev points of the region that a contact visits, and interpolated.
/// Contacts that visit the same places share these points. Thread-bound.
class GelModel {
 public:
  /// Computes the correction, which takes seconds on all cores, or reads it from a directory. The arguments need not
  /// outlive the object.
  /// \param contacts must each have at least one state
  /// \param cache directory in which corrections are kept, which is created; empty: none. A failure to read or write it
  /// is ignored
  GelModel(const sensor::Sensor& sensor, const std::vector<Contact>& contacts, const std::filesystem::path& cache = {});

  /// Returns the displacements of all markers, 3 x markers [m], with contact i in states[i]. The states must
  /// be as many as the contacts, each within the region that its contact visits. Valid until the next call.
  const sensor::Points& displacement(std::span<const ContactState> states);

 private:
  struct Patch {
    PatchField field;
    // Unit load, relative to the patch's centre.
    Eigen::Matrix2Xd points;
    Eigen::VectorXd pressed;   ///< share of the force at each point
    Eigen::Matrix2Xd turning;  ///< tangential forces under a unit torque
    Eigen::VectorXd nodesX, nodesY;
    Eigen::Index firstColumn;  ///< in correction_; the columns are node by node, x fastest, three directions each
  };

  /// Adds the half-space field to displacement_ and the interpolated nodal loads to loads_.
  void add(const Patch& patch, const ContactState& state);

  sensor::Points markers_;
  std::vector<std::size_t> depthIndex_;  ///< per marker: index of its depth
  std::vector<Patch> patches_;
  Eigen::MatrixXd correction_;  ///< 3 markers x 3 nodes of all patches [m/N]
  std::vector<ContactState> states_;
  Eigen::VectorXd loads_;
  sensor::Points displacement_;
};

}  // namespace twin

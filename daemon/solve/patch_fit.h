// Round patches fitted to the displacements themselves.
//
// The contact step's penalty blurs what it shows over some three nodes; the displacements tell much more, if it is
// known that there are a few small contacts. A patch is its place, the spread of its pressure and its force; with the
// picture's motion m,
//   minimise |d - sum over the patches of U(place, spread) force - P m|^2 + n^2 m' Q^-1 m + spread's prior
// over the valid rows, U being the influence of a round patch.
#pragma once

#include "daemon/solve/contact_step.h"
#include "daemon/solve/off_grid.h"
#include "daemon/solve/patch.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace tractiond::solve {

/// What one frame shows.
struct Picture {
  const double* displacement_px;  ///< stride of the influence matrix, 0 where missing
  std::span<const int> missing;   ///< those coordinates
  double squares_px2;             ///< of the displacements, their sum
  double noise_px;
};

/// Thread-bound. Allocates only when made.
class PatchFit {
 public:
  static constexpr int kMostPatches = 4;

  /// What is thought of a spread before, and its deviation [pitches^2]. A ball's contact of radius a has a^2 / 5.
  static constexpr double kSpread = 0.1, kSpreadDeviation = 0.25;

  PatchFit(const Inverse& inverse, const sensor::NodeGrid& nodes);

  /// The frame that is fitted from now on; `step` has solved it.
  void begin(const ContactStep& step, const Picture& picture);

  /// Improves the patches by Gauss-Newton steps from where they are; forces are found, not wanted. False: what is left
  /// is not below `most`.
  bool fit(std::span<Patch> patches, double most);

  /// The same for one patch that is more than its nodes.
  bool fit(Patch& patch, double most, OffGrid& offGrid);

  /// Whether less than `most` is left if patch `first` and the next one are the ends of one straight contact, on which
  /// force and spread change linearly from one end to the other; its force is the sum of theirs.
  bool fitsBar(std::span<Patch> patches, int first, double most);

  /// What the last fit() left, in squared deviations of the noise, priors included.
  double chiSquared() const { return chiSquared_; }

  /// Covariance of a patch's force [N], column, row and spread [pitches, pitches^2], of the last fit().
  Eigen::Matrix<double, 6, 6> covariance(int patch) const;

 private:
  static constexpr int kMostSpots = kMostPatches + 2;
  static constexpr int kMostUnknowns = 6 * kMostPatches + kMotions;
  static constexpr int kKinds = 12;  ///< share and three derivatives of the three components of force
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostUnknowns, kMostUnknowns>;
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostUnknowns, 1>;
  using Block = Eigen::Matrix<double, kKinds, kKinds>;

  /// A round patch that moves with one end, or, on a bar, with two.
  struct Spot {
    std::array<int, 2> end{};
    std::array<double, 2> place{}, force{};  ///< the ends' shares in its place and spread, and in its force
    Stencil stencil;
    Eigen::Matrix<double, kKinds, 1> right;          ///< with the displacements
    Eigen::Matrix<double, kKinds, kMotions> motion;  ///< with the motions
  };

  void lay(std::span<const Patch> patches, int bar);
  bool descend(std::span<Patch> patches, int bar, double most, double enough);
  bool evaluate(std::span<Patch> patches, int bar);
  void look(Spot& spot, double* missing);
  void addDifference(const Patch& patch);
  void assemble(std::span<const Patch> patches, bool places);
  double expectedGain(std::span<const Patch> patches, const Vector& solution) const;
  void move(std::span<const Patch> patches, const Vector& solution, std::span<Patch> to) const;
  int unknown(int end, int i) const;

  const Inverse& inverse_;
  const int columns_, rows_;
  const ContactStep* step_ = nullptr;
  OffGrid* offGrid_ = nullptr;  ///< of a fit()
  Picture picture_{};
  std::vector<double> products_;       ///< H'd, as far as this frame has asked for it
  std::vector<std::uint8_t> asked_;    ///< whether it has, for each node
  std::vector<double> missing_;        ///< of each spot, missing coordinate, component and kind: what it does there
  std::vector<double> motionMissing_;  ///< of each missing coordinate: what the motions do there
  /// Where a patch is more than its nodes, of each coordinate: what the nodes do (then scratch), the patch, the
  /// motions.
  std::vector<double> near_, sum_, motionNear_;
  Eigen::Matrix<double, kMotions, kMotions> motionGram_;
  Eigen::Matrix<double, kMotions, 1> motionRight_;
  int ends_ = 0, spots_ = 0;
  std::array<Spot, kMostSpots> spot_;
  std::array<Block, kMostSpots*(kMostSpots + 1) / 2> block_;
  Matrix linear_, normal_, covariance_;  ///< the equations of forces and motion; of everything; the latter's inverse
  Vector linearRight_, right_;
  double chiSquared_ = 0.0;
};

}  // namespace tractiond::solve

// Fits round patches to the displacements themselves.
//
// The penalty of the contact step blurs its forces over some three nodes. The displacements determine a few small
// contacts much more sharply. A patch has a place, a spread of its pressure and a force; with the motion m of the
// picture, the fit minimises
//   |d - sum over the patches of U(place, spread) force - P m|^2 + n^2 m' Q^-1 m + prior of the spreads
// over the coordinates that are not missing. U is the influence of a round patch.
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

/// The displacements of one frame. Borrowed.
struct Picture {
  const double* displacement_px;  ///< 2M, padded to the stride of the influence matrix; 0 where missing
  std::span<const int> missing;   ///< coordinates without a displacement
  double squares_px2;             ///< sum of the squared displacements
  double noise_px;                ///< n, the standard deviation of a coordinate
};

/// Thread-bound. Allocates only when made.
class PatchFit {
 public:
  static constexpr int kMostPatches = 4;  ///< largest number of patches of a fit

  /// Prior mean and standard deviation of a spread [pitches^2]. The contact of a ball, of radius a, has a^2 / 5.
  static constexpr double kSpread = 0.1, kSpreadDeviation = 0.25;

  /// `inverse` must outlive it. \param nodes grid of the sensor; on fewer than 4 x 4 nodes every fit fails
  PatchFit(const Inverse& inverse, const sensor::NodeGrid& nodes);

  /// Sets the frame for the following calls. `step` must have solved the same picture; it and the memory that `picture`
  /// refers to must last until the last of these calls.
  void begin(const ContactStep& step, const Picture& picture);

  /// Improves places and spreads of the patches, at most kMostPatches, by Gauss-Newton steps from their present values;
  /// computes their forces, whose present values are ignored. Returns false if the equations cannot be solved or
  /// chiSquared() does not fall below `most`.
  bool fit(std::span<Patch> patches, double most);

  /// Fits a single patch in the same way, with the influence corrected by `offGrid` for what its nodes do otherwise.
  bool fit(Patch& patch, double most, OffGrid& offGrid);

  /// Returns whether chiSquared() falls below `most` if the patches `first` and `first` + 1 are the ends of one
  /// straight contact, along which force and spread change linearly; its force is the sum of theirs. Changes the
  /// patches.
  bool fitsBar(std::span<Patch> patches, int first, double most);

  /// Returns what the last fit() or fitsBar() left, in units of n^2: residual and priors. This is the minimum if fit()
  /// returned true; fitsBar() stops at the first value below its `most`.
  double chiSquared() const { return chiSquared_; }

  /// Returns the covariance of a patch's force [N], column, row [pitches] and spread [pitches^2], by the last
  /// fit() that returned true. \param patch index in that fit's patches
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
  std::vector<double> products_;       ///< H'd, for the nodes for which this frame has needed it
  std::vector<std::uint8_t> asked_;    ///< of each node: 1 if its products_ are computed
  std::vector<double> missing_;        ///< influence of each spot, missing coordinate, component and kind
  std::vector<double> motionMissing_;  ///< influence of the motions on each missing coordinate
  /// Of each coordinate at which OffGrid corrects: influence of the nodes (then scratch), of the patch, of the motions.
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

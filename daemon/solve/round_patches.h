// Fits round patches to a picture (docs/mathematics.md, 4.4). Each has a place, a spread, a force and a
// torsion. With the motion m of the picture, in standard deviations of its prior, the fit minimises
//   |d - sum over the patches of U(place) load - P m|^2 / n^2 + |m|^2 + ((spread - s) / deviation of s)^2
// over the coordinates that are not missing. U is PatchInfluence. Whether two patches are one straight contact is
// tested by fitting them as its ends: force and spread change linearly between them, and its force is the sum of
// theirs.
#pragma once

#include "daemon/solve/extra_unknowns.h"
#include "daemon/solve/patch_influence.h"
#include "daemon/solve/roughness.h"

#include <array>
#include <limits>

namespace tractiond::solve {

/// A round contact: where it is, and what it carries.
struct RoundPatch {
  PatchPlace place;
  PatchLoad load = PatchLoad::Zero();
};

/// How far the shear of a contact is spread: its mean squared distance from the centre over that of the pressure.
struct SpreadRatio {
  double value = 0.0;
  double deviation = 0.0;  ///< 0: not known
};

/// Thread-bound. Allocates only when made.
class RoundPatches {
 public:
  static constexpr int kMost = 4;  ///< largest number of patches
  /// Spread from which on a contact is not described as a round patch [pitches^2].
  static constexpr double kWidest = 1.5;
  /// Prior standard deviations around the patches that were found: of a load as a multiple of its force (of the
  /// torsion: of force times pitch), of a place [pitches].
  static constexpr double kFreeLoad = 3.0, kFreePlace = 1.0;
  /// Log evidence that each patch must gain: what is read of it holds for round contacts alone, and faint contacts of
  /// any shape look round.
  static constexpr double kLeastGain = 10.0;
  /// Prior mean s and standard deviation of a spread [pitches^2]. The contact of a ball, of radius a, has a^2 / 5.
  static constexpr double kSpread = 0.3, kSpreadDeviation = 0.6;

  /// `sensor` is read here alone; the others must outlive it. PatchInfluence::possible() must be true.
  RoundPatches(const sensor::Sensor& sensor, const Atoms& atoms, const Factors& factors);

  /// Finds the patches of a picture. Starts from the maxima of the pressure in `forces_N` (3P, x, y, z of each point:
  /// the field of the same picture) and drops those without which the rest is more likely. If misfit() exceeds
  /// `enough`, also tries fainter maxima, and two patches in place of a long one. Returns false if there are no patches
  /// or more than kMost, or if they are too broad or cannot be told apart; the results then have no meaning. True does
  /// not mean that misfit() is at most `enough`.
  bool find(const Displacements& picture, std::span<const double> forces_N, double enough);

  /// Finds the patch, if one explains the picture. Returns false if it is too broad, or its misfit() above `enough`;
  /// the results then have no meaning.
  /// \param start where the fit starts [m]
  bool findOne(const Displacements& picture, const Eigen::Vector3d& start, double enough);

  /// Determines which patches are parts of one contact: those that overlap, and those that one straight contact
  /// explains as well. `picture` as in find(). May take several times as long as find().
  void join(const Displacements& picture);

  // Results of the last find() or findOne(). Pointers and spans are valid until the next one.

  /// Returns the patches; their order has no meaning.
  std::span<const RoundPatch> patches() const { return {now_.patches.data(), static_cast<std::size_t>(count_)}; }
  /// Returns the minimum of the expression at the top of this file.
  double misfit() const { return now_.misfit; }
  /// Returns the first patch of the contact that a patch is part of, by the last join(), which must follow find().
  int contactOf(int patch) const { return contact_[patch]; }
  /// Returns the displacements by a unit of a patch's load (0 to 2: force [px/N]; 3: torsion [px/(N m)]): 2M, padded, 0
  /// where missing.
  const double* column(int patch, int load) const { return nth(now_.columns, kPatchLoads * patch + load); }
  /// Ends the fit, and computes slope(). `picture` as in find() and findOne(), which make do with slopes of a
  /// half-space. Returns false if the equations could not be solved; the results then have no meaning.
  bool linearise(const Displacements& picture);
  /// Returns the derivatives of the displacements by a patch's place (0: x, 1: y [px/m]; 2: spread [px/m^2]): 2M,
  /// padded, 0 where missing. After linearise().
  const double* slope(int patch, int place) const { return nth(now_.slopes, kPatchPlaces * patch + place); }

  /// Powers of a shift: x^2, xy, y^2, x^3, x^2 y, x y^2, y^3.
  static constexpr int kPowers = 7;
  /// Computes what a patch displaces beyond slope() after a shift of its place: as the factors of these powers of the
  /// shift in pitches, for up to one pitch.
  /// \param columns kPowers columns of 2M, padded [px]
  void curves(int patch, double* columns) const;

  /// Computes how the displacements by a unit of a patch's shear change with its spread [px/(N m^2)]: 2M, padded.
  /// \param axis 0: along x, 1: along y
  void shearSlope(int patch, int axis, double* column) const;

  /// Subtracts the patches from the displacements.
  /// \param left_px remainder, which includes the picture's motion
  /// \param still_px the same without the motion. Both 2M, padded.
  void leave(double* left_px, double* still_px) const;

 private:
  static constexpr int kMostLinear = kPatchLoads * kMost + kMotions;
  static constexpr int kMostUnknowns = kMostLinear + kPatchPlaces * kMost;
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostUnknowns, kMostUnknowns>;
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostUnknowns, 1>;

  /// Patches at some places, with the loads that fit best there.
  struct Fit {
    std::array<RoundPatch, kMost> patches;
    std::array<double, kMotions> motion{};
    double misfit = 0.0;
    LineArray<double> columns;  ///< by the loads
    LineArray<double> left;     ///< what remains
    Matrix linear;              ///< the equations of loads and motion
    // What differentiate() adds.
    LineArray<double> slopes;  ///< by the places
    Matrix normal;             ///< the equations of everything
    Vector right;
  };

  bool findMaxima(std::span<const double> forces_N);
  bool areNarrow(int but = -1) const;
  PatchPlace startAt(const Eigen::Vector3d& place) const;
  template <typename Change, typename Fits>
  bool isLikelier(const Displacements& picture, Change change, Fits fits);
  void dropUnlikely(const Displacements& picture);
  void addLikely(const Displacements& picture, double enough);
  void split(const Displacements& picture, double enough);
  Eigen::Vector2d halfLength(int patch) const;
  bool areTwoContacts(const Displacements& picture, int a, int b);
  bool isBar(const Displacements& picture, int a, int b);

  // round_patches_fit.cpp
  void takeMotion(const Displacements& picture);
  bool descend(const Displacements& picture, double most = std::numeric_limits<double>::infinity(),
               double enough = 0.0);
  int leastEvident() const;
  double logEvidence() const;
  double mostMisfit(double logEvidence) const;
  bool solveLoads(const Displacements& picture, Fit& fit);
  void differentiate(const Displacements& picture);
  void laySlopes(const Displacements& picture);
  bool findStep(double damping, Vector& step);
  bool holdsAtWidest(const Vector& step);
  void move(const Vector& step, std::array<RoundPatch, kMost>& to) const;
  void layColumns(const Displacements& picture, Fit& fit);
  void layBar(Fit& fit);
  void differentiatePlace(RoundPatch patch, int i, double* slope);
  void differentiateRound(int patch);
  void differentiateBar();
  double unitOf(int place) const;
  void displacement(const RoundPatch& patch, double* column);
  bool isEnd(int patch) const { return patch == bar_[0] || patch == bar_[1]; }
  void clear(std::span<const int> missing, double* column) const;
  int loads() const { return kPatchLoads * count_; }
  int linear() const { return loads() + kMotions; }
  double* nth(LineArray<double>& columns, int number) const { return columns.data() + number * influence_.stride(); }
  const double* nth(const LineArray<double>& columns, int number) const {
    return columns.data() + number * influence_.stride();
  }

  const Atoms& atoms_;
  const Factors& factors_;
  PatchInfluence influence_;
  Spread spread_;
  Eigen::VectorXd force_, height_;  // P: magnitudes, and their averages over a pitch
  std::vector<int> maxima_;         // points, of the heights
  int count_ = 0;
  std::array<int, 2> bar_ = {-1, -1};  // patches that are the ends of one straight contact
  std::array<int, kMost> contact_{};
  std::array<bool, kMost * kMost> areTwo_{};  // a before b: known not to be a bar
  Fit now_, next_, kept_, pair_;
  LineArray<double> motion_;  // kMotions columns, 0 where missing
  LineArray<double> here_, spot_;
  bool isExact_ = false;  // the slopes are those of the block
  Matrix damped_;
  Vector right_;
};

}  // namespace tractiond::solve

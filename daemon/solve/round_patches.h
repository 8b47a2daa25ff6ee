// Fits round patches to a picture (docs/decisions/0020-one-inverse.md): each a place, a spread, a force and a torsion;
// with the picture's motion m in deviations of its prior,
//   minimise |d - sum over the patches of U(place) load - P m|^2 / n^2 + |m|^2 + ((spread - s) / deviation of s)^2
// over the coordinates that are there, U being PatchInfluence. To find out whether two are one straight contact, they
// are fitted as its ends: force and spread change linearly from one to the other, the sum of the force being theirs.
#pragma once

#include "daemon/solve/extra_unknowns.h"
#include "daemon/solve/patch_influence.h"
#include "daemon/solve/roughness.h"

#include <array>
#include <limits>

namespace tractiond::solve {

struct RoundPatch {
  PatchPlace place;
  PatchLoad load = PatchLoad::Zero();
};

/// Thread-bound. Allocates only when made.
class RoundPatches {
 public:
  static constexpr int kMost = 4;
  /// A patch as broad as this is none [pitches^2].
  static constexpr double kWidest = 1.5;
  /// Prior deviations of what is found: of a load as a multiple of the force (and of a pitch, the torsion), of a place
  /// [pitches].
  static constexpr double kFreeLoad = 3.0, kFreePlace = 1.0;

  /// `sensor` is read here alone; the others must outlive it. PatchInfluence::possible() must be true.
  RoundPatches(const sensor::Sensor& sensor, const Atoms& atoms, const Factors& factors);

  /// Finds the patches of a picture, from the maxima of the pressure that its field's `forces_N` (3P) have, but for
  /// those without which the rest is more likely. If the misfit is more than `enough`, fainter maxima are looked at,
  /// too, and two patches in place of a long one, if they are two contacts. False: there are none or too many, they are
  /// too broad or cannot be told apart. The picture must last as long as what was found is asked for.
  bool find(const Displacements& picture, std::span<const double> forces_N, double enough);

  /// Finds out which patches are parts of one contact: those that overlap, and those that one straight contact explains
  /// as well. May take several times as long as find().
  void join(const Displacements& picture);

  // What was found.
  std::span<const RoundPatch> patches() const { return {now_.patches.data(), static_cast<std::size_t>(count_)}; }
  double misfit() const { return now_.misfit; }  ///< the minimum
  /// The first patch of the same contact, by the last join().
  int contactOf(int patch) const { return contact_[static_cast<std::size_t>(patch)]; }
  const double* column(int patch, int load) const { return column(now_, kPatchLoads * patch + load); }
  /// Derivative of the displacements by x, y [px/m] or spread [px/m^2], 0 where missing.
  const double* slope(int patch, int place) const { return slopeColumn(now_, kPatchPlaces * patch + place); }

  /// Computes the displacements that the patches leave, and the same without the picture's motion. 2M, padded.
  void leave(double* left_px, double* still_px) const;

 private:
  /// Prior of a spread [pitches^2]. A ball's contact of radius a has a^2 / 5.
  static constexpr double kSpread = 0.3, kSpreadDeviation = 0.6;
  static constexpr int kMostLinear = kPatchLoads * kMost + kMotions;
  static constexpr int kMostUnknowns = kMostLinear + kPatchPlaces * kMost;
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostUnknowns, kMostUnknowns>;
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostUnknowns, 1>;

  /// Patches somewhere, with the loads that explain most.
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
  bool areNarrow() const { return areNarrowBut(-1); }
  bool areNarrowBut(int patch) const;
  PatchPlace startAt(const Eigen::Vector3d& place) const;
  void dropUnlikely(const Displacements& picture);
  void addLikely(const Displacements& picture, double enough);
  void split(const Displacements& picture, double enough);
  Eigen::Vector2d halfLength(int patch) const;
  bool areApart(const Displacements& picture, int a, int b);
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
  bool findStep(double damping, Vector& step);
  bool holdsAtWidest(const Vector& step);
  void move(const Vector& step, std::array<RoundPatch, kMost>& to) const;
  void layColumns(const Displacements& picture, Fit& fit);
  void layBar(Fit& fit);
  void differentiatePlace(RoundPatch patch, int i, double* slope);
  void differentiateRound(int patch);
  void differentiateBar();
  double unitOf(int place) const;
  void addUp(int patch, double* column) const;
  bool isEnd(int patch) const { return patch == bar_[0] || patch == bar_[1]; }
  void clear(std::span<const int> missing, double* column) const;
  int loads() const { return kPatchLoads * count_; }
  int linear() const { return loads() + kMotions; }
  const double* column(const Fit& fit, int number) const;
  double* slopeColumn(Fit& fit, int number) const {
    return fit.slopes.data() + number * std::ptrdiff_t{influence_.stride()};
  }
  const double* slopeColumn(const Fit& fit, int number) const {
    return fit.slopes.data() + number * std::ptrdiff_t{influence_.stride()};
  }
  const double* unknownColumn(int unknown) const;

  const Atoms& atoms_;
  const Factors& factors_;
  PatchInfluence influence_;
  Spread spread_;
  Eigen::VectorXd force_, height_;  // P: magnitudes, and their averages over a pitch
  std::vector<int> maxima_;         // points, of the heights
  int count_ = 0;
  std::array<int, 2> bar_ = {-1, -1};  // patches that are the ends of one straight contact
  std::array<int, kMost> contact_{};
  std::array<bool, static_cast<std::size_t>(kMost* kMost)> apart_{};  // a before b: known not to be a bar
  Fit now_, next_, kept_, pair_;
  LineArray<double> motion_;  // kMotions columns, 0 where missing
  LineArray<double> here_, spot_;
  Matrix damped_;
  Vector right_;
};

}  // namespace tractiond::solve

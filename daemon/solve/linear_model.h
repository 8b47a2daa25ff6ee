// Answers a picture by the model of an earlier one (docs/mathematics.md, 4.10): the candidates, their atoms, priors and
// points of linearisation are those of a finished Model::solve(); displacements, noise and missing markers are this
// picture's. Takes a small part of the time of a solve. This picture itself tells whether the model still holds.
#pragma once

#include "daemon/solve/linear_posterior.h"
#include "daemon/solve/model.h"
#include "daemon/solve/residual_test.h"
#include "daemon/solve/shear_spread.h"

#include <array>
#include <memory>
#include <span>
#include <vector>

namespace tractiond::solve {

/// Thread-bound; make() and answer() may be called by different threads, one after the other.
class LinearModel {
 public:
  /// What speaks against a model.
  struct Doubt {
    double significance = 0.0;  ///< deviations of the most significant force that it leaves in the picture
    double misfit = 0.0;        ///< deviations of chi^2 of the picture from its expectation
    double scale = 1.0;         ///< by which its prior had to grow
    double shift = 0.0;         ///< of the patch that has moved farthest [pitches]
    double force = 1.0;         ///< as a multiple of that which the model was made with
  };

  /// `factors` and `atoms` must outlive it.
  /// \param modes of the same factors and atoms
  LinearModel(const Factors& factors, const Atoms& atoms, std::shared_ptr<const StrongModes> modes);

  /// Makes it from the last solve() of a model, with the outcome kFound. Returns false if it was not possible. The
  /// arguments need not outlive the call.
  bool make(Model& model, const Estimate& estimate, LinearScratch& scratch);

  /// Answers a picture. Returns whether the model holds for it; otherwise the results have no meaning.
  /// \param shown looked at this picture last
  /// \param estimate as in Model::solve(); atoms and rounds are those of the model
  bool answer(const Displacements& picture, const Modes& shown, Estimate& estimate);

  // Results of the last answer().

  const Doubt& doubt() const { return doubt_; }
  /// Returns what the estimate is the mean of, with its covariances.
  Mixture& mixture() { return mixture_; }

 private:
  static constexpr int kMost = 4;  // candidates
  struct Part {
    LinearPosterior posterior;
    double penalty = 0.0;  // Model::Solved::penalty
    Mixture::Kind kind = Mixture::Kind::kField;
    bool isPatched() const { return kind == Mixture::Kind::kPatched; }
  };

  const RowMatrix& curvesOf(const Part& part) const { return part.isPatched() ? curves_ : noCurves_; }
  std::span<const double> times(const Part& part) const { return std::span(times_).first(curvesOf(part).rows()); }
  std::span<Part> parts() { return std::span(parts_).first(count_); }
  bool solveFirst(double noise_px);
  bool holds() const;
  void findSpreadRatios(double noise_px);
  bool solve(Part& part, double noise_px);
  double straighten(const Part& part, std::span<double> times);
  double squaresWithoutCurves(const Part& part);
  void takeCurves(const RoundPatches& patches);
  void takePicture(const Displacements& picture);
  Wrench wrenchOf(const Part& part) const;
  void addForces(const Part& part, std::span<double> forces);
  RoundPatch patchNow(const Part& part, int patch, double& grown) const;
  void findPatches(Estimate& estimate);

  const Factors& factors_;
  const Atoms& atoms_;
  std::vector<Part> parts_;
  ResidualTest test_;
  Mixture mixture_;
  PatchSpread spread_;
  ShearSpread shearSpread_;
  // Of the picture that it was made from.
  int count_ = 0;  // parts; the first one is the likeliest
  FreedPatches patches_;
  RowMatrix curves_;  // RoundPatches::curves() of each patch
  RowMatrix noCurves_;
  std::array<int, RoundPatches::kMost> contact_{};
  std::vector<int> missingThen_;
  int atomCount_ = 0, rounds_ = 0;
  Doubt own_;
  // Of the last answer.
  Doubt doubt_;
  std::array<SpreadRatio, RoundPatches::kMost> spreadRatio_{};
  LineArray<double> displacement_, straight_;  // straight_: as if what the patches do were linear in their shifts
  double shift_ = 0.0;                         // as Doubt::shift, of the candidate that was solved last
  std::array<double, RoundPatches::kMost * RoundPatches::kPowers> times_{};  // so much of each curve, likewise
  std::vector<float> shown_, completed_;  // with what detection, and what the model, make of what is missing
  std::vector<float> coefficients_;
  std::vector<int> missing_, added_;  // of both pictures; of this one alone
  std::vector<double> atomForces_;
};

}  // namespace tractiond::solve

// Computes the field of one contact that presses evenly within its edge (docs/mathematics.md, 4.5). Its
// footprint e, a number for each point, is drawn from forces that were found; p and t are their means around a point
// over a short and a long distance:
//   e(c) = t clamp((p / t - c + w) / 2 w, 0, 1)        w: half of the width of the edge, c: where it is
//   f = 3 e(c) u + (e(c - s) - e(c + s)) / 2 v + roughness        u, v ~ N(0, 1): three components each
// The footprint is the connected region with the most force; its edge may move by about s. The field is solved for a
// medium roughness first. Then the footprint is drawn from the result, and the field is solved for each roughness, the
// smallest first, until a larger one is far less likely than the one before.
#pragma once

#include "daemon/solve/posterior.h"
#include "daemon/solve/prior.h"
#include "daemon/solve/roughness.h"

#include <array>

namespace tractiond::solve {

/// Thread-bound. Allocates only when made.
class EvenField {
 public:
  /// Values of rho (ModelConstants::kRoughness) that are tried; equally probable a priori.
  static constexpr std::array kRoughness = {0.2, 0.4, 0.8};

  /// All references must outlive it. The points must be a grid.
  EvenField(const Factors& factors, const Atoms& atoms, Selection& selection, Roughness& roughness);

  /// Solves for the field. Returns false if equations could not be solved, or if the first solution is far less likely
  /// than `least`; the results then have no meaning.
  /// \param products of the picture
  /// \param forces_N of the points (3P), from which the footprint is drawn; not all 0 (asserted)
  /// \param degrees of freedom that were used for them
  /// \param least log evidence of what explains the picture otherwise
  bool solve(const Displacements& picture, AtomProducts& products, std::span<const double> forces_N, double degrees,
             double least);

  /// Returns the number of values of kRoughness that solve() has solved for; they are the first ones.
  int count() const { return count_; }

  // Results of solve() with the roughness kRoughness[i], i < count().

  /// Returns the posterior of the atoms and, as extra unknowns, of u and v. Valid until the next solve().
  Posterior& posterior(int i) { return solutions_[i].posterior; }
  /// Returns the log evidence, reduced for the choice of roughness and by kOptimism for each degree of freedom, but
  /// for no fewer than the forces have that the footprint was drawn from.
  double logEvidence(int i) const { return logEvidence_[i]; }
  /// Computes the forces of the points (3P [N]).
  void pointForces_N(int i, std::span<double> forces);

 private:
  static constexpr int kUnknowns = 6, kMostAtoms = ModelConstants::kMost[0].back();
  void draw(std::span<const double> forces_N);
  void drawFootprint(double edge, Eigen::VectorXd& footprint) const;
  void keepLargestPart();
  void setUnknowns(const Displacements& picture);
  bool fit(const Displacements& picture, AtomProducts& products, int i);
  double worth(int i);

  const Factors& factors_;
  const Atoms& atoms_;
  Selection& selection_;
  Roughness& roughness_;
  Spread near_, around_;
  std::vector<ChosenPosterior> solutions_;  // of each roughness
  ExtraUnknowns extra_;
  // Of one frame.
  int count_ = 0;
  double fieldDegrees_ = 0.0;  // of the forces that the footprint was drawn from first
  std::array<double, kRoughness.size()> logEvidence_{};
  std::vector<int> part_, open_;                  // P: the part of the footprint that a point belongs to, or -1
  Block omega_ = Block::Identity();               // directions of all atoms
  Eigen::VectorXd force_, pressure_, level_;      // P: magnitudes; p, t
  Eigen::VectorXd footprint_, smaller_, larger_;  // P: e at its edge, and with the edge moved
  std::vector<double> even_, forces_;             // 3P: footprint_ along z; of all atoms 3A
  std::vector<int> rows_;                         // of the influence, of the points that an unknown acts at
  std::vector<float> coefficients_;               // of each of these
  LineArray<double> column_;
};

}  // namespace tractiond::solve

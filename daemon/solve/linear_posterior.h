// The posterior of one candidate as a linear function of the picture, made from that of an earlier picture: the same
// atoms and priors, the same patches as points of linearisation, other displacements.
//
//   d = B R theta + noise,  theta ~ N(0, s^2)     R: root of the prior; of an atom that of gamma Omega, elsewhere 1
//   R B'B R / n^2 = Q Lambda Q' + little          what the picture sees of theta: xi = Q' theta
//   y = (B R Q)' d / n^2                          all that it says of xi
//   xi ~ N(y / (Lambda + 1 / s^2), 1 / (Lambda + 1 / s^2));  across Q the prior stays: N(0, s^2)
//
// The patches' loads are free about 0 here, their places about those of the earlier picture. s >= 1 lets the prior grow
// with the load: it is the larger of its likeliest value and of the ratio of the forces now and then. Coordinates that
// are missing now, but were not then, are taken out of Lambda.
#pragma once

#include "daemon/solve/candidate.h"
#include "daemon/solve/posterior.h"

#include <array>
#include <span>
#include <vector>

namespace tractiond::solve {

/// What make() computes with; grows when it is used.
struct LinearScratch {
  Eigen::MatrixXd gram, root;  ///< R B'B R / n^2, and its root
  std::vector<int> pivots;
  RowMatrix seen;  ///< columns of B R at the pivots, row after row
};

/// Thread-bound; make() and answer() may be called by different threads, one after the other.
class LinearPosterior final : public Candidate {
 public:
  static constexpr int kMostRank = 320;  ///< the most elements of xi
  /// Returns the most unknowns, for the most atoms and extra unknowns of a posterior.
  static int mostUnknowns(int most, int mostExtra) { return 3 * most + mostExtra + kMotions; }

  /// `factors` and `atoms` must outlive it. \param most atoms, \param mostExtra extra unknowns of a posterior
  LinearPosterior(const Factors& factors, const Atoms& atoms, int most, int mostExtra);

  /// Makes it from the last fit() of a posterior, which need not outlive the call. Returns false if it was not
  /// possible. \param products of the posterior's picture, \param missing its coordinates without a displacement \param
  /// force_N magnitude of the force that was found, in proportion to which the prior may grow \param curves
  /// displacements that solve() may take off [px]: 2M columns
  bool make(const Posterior& posterior, AtomProducts& products, std::span<const int> missing, double force_N,
            const RowMatrix& curves, LinearScratch& scratch);

  // A picture is answered by read(), solve() with one or more guesses of the curves, and weigh().

  /// Starts on a picture. Returns false if it misses too much. \param displacement_px 2M, padded, 0 where any of the
  /// two pictures misses them \param added coordinates that it misses and that of make() did not \param curves as in
  /// make()
  bool read(const double* displacement_px, double noise_px, std::span<const int> added, const RowMatrix& curves);
  /// Computes scale(), xi() and extra() of the picture less so much of each curve. Returns false if the equations could
  /// not be solved; the results then have no meaning. \param times as many as there were curves in make()
  bool solve(std::span<const double> times);
  /// Computes the other results. \param squares_px2 of what solve() solved
  void weigh(double squares_px2);

  // Results of the last solve() and weigh().

  double logEvidence() const { return logEvidence_; }        ///< as Posterior::logEvidence(), of the same picture
  double misfit() const { return misfit_; }                  ///< chi^2 of the picture, if the model holds
  double scale() const { return scale_; }                    ///< s
  double grown() const { return forceOfXi_N() / force_N_; }  ///< the force, as a multiple of that in make()
  std::span<const double> xi() const { return {xi_.data(), static_cast<std::size_t>(rank_)}; }
  /// Returns xi at s = 1.
  std::span<const double> firstXi() const { return {firstXi_.data(), static_cast<std::size_t>(rank_)}; }
  /// Returns the values of the extra unknowns.
  std::span<const double> extra() const {
    return {theta_.data() + firstExtra(), static_cast<std::size_t>(extraCount_)};
  }
  /// Returns the force of the i-th of atoms() [N]; of weigh().
  Eigen::Vector3d atomForce_N(std::size_t i) const { return roots_[i] * Eigen::Vector3d::Map(theta_.data() + 3 * i); }
  /// Returns force and moment about the origin [N, N m].
  Wrench wrench() const;
  /// Computes the forces of all atoms (3A [N]).
  void allForces_N(std::span<double> forces) const;
  /// Adds the forces of the points and the couples by the extra unknowns (3 (P + kCouples)).
  void addExtraForces_N(std::span<double> forces) const;
  /// Computes the covariance of some extra unknowns, row after row. \param unknowns at most kColumns of them
  void extraCovariance(std::span<const int> unknowns, std::span<double> covariance);
  /// Computes what displacements v show of xi, (B R Q)' v / n^2 with the noise of make(). \param column_px 2M, padded
  void readColumn(const double* column_px, std::span<double> ofXi) const;
  /// Subtracts what a displacement at one coordinate shows.
  void subtractAt(int coordinate, double displacement_px, std::span<double> ofXi) const;
  /// Multiplies by the covariance of the last answer's xi, in place.
  void multiplyCovariance(std::span<double> ofXi) const;
  /// Fills in what was found at the coordinates that are missing: make()'s `missing`, where the extra unknowns do not
  /// act, and those `added`. \param displacement_px 2M
  void complete(std::span<const int> missing, std::span<const int> added, std::span<float> displacement_px) const;

  // Implement Candidate.
  const std::array<double, kMotions>& motion() const override { return motion_; }
  double squaredResidual_px2() const override { return squaredResidual_; }
  void wrenchCovariance(std::array<double, 36>& covariance) override;
  void nodeDeviations_N(std::span<double> deviations) override;
  void covariance(std::span<const double> weights, std::span<const int> points, std::span<double> covariance) override;
  void leastVariances(std::span<const double> weights, std::span<const int> points,
                      std::span<double> variances) override;

  // What it was made of.

  int rank() const { return rank_; }  ///< number of elements of xi
  double noise_px() const { return noise_px_; }
  std::span<const int> atoms() const { return atoms_; }
  /// Returns the root of the prior of the i-th of atoms().
  const Block& root(int i) const { return roots_[i]; }
  struct Sharing {
    std::span<const int> atoms;      ///< indices in atoms()
    std::span<const double> shares;  ///< of the force of each
  };
  /// Returns which atoms act at a point.
  Sharing sharing(std::size_t point) const {
    const std::size_t first = sharingFirst_[point], count = sharingFirst_[point + 1] - first;
    return {{sharing_.data() + first, count}, {shares_.data() + first, count}};
  }
  int firstExtra() const { return 3 * static_cast<int>(atoms_.size()); }
  int extraCount() const { return extraCount_; }
  std::span<const double> lambda() const { return {lambda_.data(), static_cast<std::size_t>(rank_)}; }
  /// Returns B R Q / n at the missing coordinates of make(), a row for each.
  const Eigen::MatrixXd& seenWhereMissing() const { return seenWhereMissing_; }
  /// Returns Q', rank() x unknowns: those of the atoms, the extra ones and the motion.
  const Eigen::MatrixXd& unknownsOfXi() const { return q_; }

 private:
  int firstMotion() const { return firstExtra() + extraCount_; }
  int unknowns() const { return firstMotion() + kMotions; }
  bool takePrior(const Posterior& posterior);
  void assemble(const Posterior& posterior, const AtomProducts& products, Eigen::MatrixXd& gram) const;
  void layRows(const Posterior& posterior, const Eigen::MatrixXd& combine, LinearScratch& scratch);
  void layMissing(std::span<const int> missing);
  void layNodes(const Posterior& posterior);
  void layWrench(const Posterior& posterior);
  void layShares(const Posterior& posterior);
  void layCurves(std::span<const int> missing, const RowMatrix& curves);
  void takeOut(std::span<const int> added);
  bool solveWith(double scale);
  void findUnknowns(int first, int count);
  double likeliestScale() const;
  double forceOfXi_N() const;
  double dot(const std::vector<double>& a, const std::vector<double>& b) const;
  // linear_posterior_covariance.cpp
  void whiten(double* columns) const;
  void denseNodeVariances(std::span<double> variances);
  void beginFunctionals();
  void setFunctionals(std::span<const double> weights, std::span<const int> points);
  void showFunctionals(int rank);
  void use(int atom);
  double* blocks() { return functionals_.row(extraCount_).data(); }
  void functionalCovariance(int count, double* covariance);
  /// Returns the packed root of the precision.
  std::span<double> factor() { return {root_, static_cast<std::size_t>(rank_ * (rank_ + 1) / 2)}; }
  std::span<const double> factor() const { return {root_, static_cast<std::size_t>(rank_ * (rank_ + 1) / 2)}; }

  const Factors& factors_;
  const Atoms& model_;
  // Of the picture that it was made from.
  double noise_px_ = 0.0, force_N_ = 0.0;
  int rank_ = 0, extraCount_ = 0;
  std::vector<int> atoms_, indexOf_;  // indexOf_: A, of each atom in atoms_, or -1
  std::vector<Block> roots_;
  // Point after point, and couple after couple: which atoms act there, by their indices in atoms_, with which share of
  // their force; which extra unknowns, with which force. Those of a point begin at sharingFirst_ and extraFirst_.
  std::vector<int> sharing_, extraUnknowns_;
  std::vector<double> shares_, extraShares_;
  std::vector<std::size_t> sharingFirst_, extraFirst_;
  std::vector<double> lambda_;  // ascending
  RowMatrix rows_;              // (B R Q)' / n^2, rank x 2M
  Eigen::MatrixXd q_;           // Q', rank x unknowns; what is across it is a small difference
  Eigen::MatrixXd seenWhereMissing_;
  Eigen::MatrixXd curves_;           // rank x curves: y of each
  std::vector<float> nodes_;         // 3N x rank, padded: forces by xi
  std::vector<double> nodesUnseen_;  // 3N: prior variance of what is across Q
  Eigen::Matrix<double, 6, Eigen::Dynamic> wrench_;
  Eigen::Matrix<double, 6, 6> wrenchUnseen_ = Eigen::Matrix<double, 6, 6>::Zero();
  // Of the last answer.
  double squaredNoise_px2_ = 0.0, ratio_ = 1.0;  // of the picture; of the squared noise then and now
  double logEvidence_ = 0.0, misfit_ = 0.0, scale_ = 1.0, squaredResidual_ = 0.0, logDeterminant_ = 0.0;
  bool isDense_ = false;                                             // coordinates were added
  std::vector<double> read_, y_, xi_, firstXi_, theta_, precision_;  // read_: y of the picture with its curves
  Eigen::MatrixXd curvesNow_;                                        // curves_, where coordinates were added
  // If coordinates were added: their B R Q / n; its product, what Lambda lacks; the packed root of the precision.
  LineArray<double> dense_;
  double *taken_ = nullptr, *root_ = nullptr;
  std::vector<const double*> addedRows_;
  // Functionals of theta: of the extra unknowns, then a block of three rows for each atom that they read.
  std::vector<int> used_, blockOf_;  // used_: these, as indices in atoms(); blockOf_: the block of each; -1: none
  Eigen::Matrix<double, Eigen::Dynamic, kColumns, Eigen::RowMajor> functionals_;
  LineArray<double> seenColumns_;  // rank x kColumns: of xi
  LineArray<double> scratch_;
  std::vector<int> everyRow_;
  std::vector<float> coefficients_;
  std::array<double, kMotions> motion_{};
};

}  // namespace tractiond::solve

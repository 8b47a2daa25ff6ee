// The posterior of one candidate as a linear function of the picture, made from that of an earlier picture: the same
// atoms and priors, the same patches as points of linearisation, other displacements.
//
//   d = B R theta + noise,  theta ~ N(0, s^2)     d: displacements [px], noise: n [px] in each, B: as in posterior.h
//                                                 R: root of the prior; of an atom that of gamma Omega, elsewhere 1
//   R B'B R / n^2 = Q Lambda Q' + little          what the picture sees of theta: xi = Q' theta
//   y = (B R Q)' d / n^2                          all that it says of xi
//   xi ~ N(y / (Lambda + 1 / s^2), 1 / (Lambda + 1 / s^2));  across Q the prior stays: N(0, s^2)
//
// The patches' loads are free about 0 here, their places about those of the earlier picture. s >= 1 lets the prior grow
// with the load: it is the larger of its likeliest value and of the ratio of the forces now and then. Coordinates that
// are missing now, but were not then, are taken out of Lambda.
//
// theta has 3 elements for each atom, then the extra unknowns (the loads and places of the patches), then the kMotions
// of the picture, each in units of its prior deviation. A displacement is a "coordinate": 2M of them, u and v of each
// marker. "Then" is the picture of make(), "now" that of the last read().
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

/// Thread-bound. make() may be called by another thread than the functions that answer a picture, one after the other.
class LinearPosterior final : public Candidate {
 public:
  static constexpr int kMostRank = 320;  ///< the most elements of xi
  /// Returns the largest number of elements of theta.
  /// \param most atoms of a posterior
  /// \param mostExtra extra unknowns of a posterior
  static int mostUnknowns(int most, int mostExtra) { return 3 * most + mostExtra + kMotions; }

  /// Allocates for the largest posterior. `factors` and `atoms` must outlive it.
  /// \param most atoms of a posterior
  /// \param mostExtra extra unknowns of a posterior
  LinearPosterior(const Factors& factors, const Atoms& atoms, int most, int mostExtra);

  /// Makes it from the last fit() of a posterior, which need not outlive the call. Returns false if a prior covariance
  /// is not positive definite or an eigenvalue is not found; it must not answer a picture then.
  /// \param products of the posterior's picture; missing products of its atoms are added
  /// \param missing coordinates without a displacement
  /// \param force_N magnitude of the force that was found, in proportion to which the prior may grow
  /// \param curves displacements that solve() may subtract [px]: a row of 2M for each
  /// \param scratch grows to the size that is needed
  bool make(const Posterior& posterior, AtomProducts& products, std::span<const int> missing, double force_N,
            const RowMatrix& curves, LinearScratch& scratch);

  // A picture is answered by read(), solve() with one or more guesses of the curves, and weigh().

  /// Starts on a picture. Returns false if more than 512 coordinates were added.
  /// \param displacement_px 2M, padded; 0 where it is missing now or was then
  /// \param noise_px standard deviation of each coordinate now
  /// \param added coordinates that are missing now and were not then
  /// \param curves the same as in make()
  bool read(const double* displacement_px, double noise_px, std::span<const int> added, const RowMatrix& curves);
  /// Subtracts the curves from the picture and solves for xi. Computes the first group of results below. Returns false
  /// if the equations could not be solved; the results then have no meaning.
  /// \param times how much of each curve is subtracted, one number for each
  bool solve(std::span<const double> times);
  /// Computes the second group of results below. Must be called after solve().
  /// \param squares_px2 sum of the squared displacements of the picture that solve() has solved for, without the curves
  void weigh(double squares_px2);

  // Results of the last solve().

  /// Returns s, the factor by which the prior deviations have grown, 1 or more.
  double scale() const { return scale_; }
  /// Returns the magnitude of the resultant, as a multiple of `force_N` in make().
  double grown() const { return forceOfXi_N() / force_N_; }
  /// Returns xi, rank() elements.
  std::span<const double> xi() const { return {xi_.data(), static_cast<std::size_t>(rank_)}; }
  /// Returns what xi would be with s = 1.
  std::span<const double> firstXi() const { return {firstXi_.data(), static_cast<std::size_t>(rank_)}; }
  /// Returns the values of the extra unknowns, in their order [prior deviations].
  std::span<const double> extra() const {
    return {theta_.data() + firstExtra(), static_cast<std::size_t>(extraCount_)};
  }

  // Results of the last weigh().

  /// Returns the log evidence, with that of s. It may be compared with the log evidences of other candidates of the
  /// same picture (Posterior::logEvidence()).
  double logEvidence() const { return logEvidence_; }
  /// Returns d' C^-1 d, where C is the covariance that model and noise expect of the displacements. If the model holds,
  /// this is chi^2 with as many degrees of freedom as coordinates are not missing.
  double misfit() const { return misfit_; }
  /// Returns the force of the i-th of atoms() [N].
  Eigen::Vector3d atomForce_N(std::size_t i) const { return roots_[i] * Eigen::Vector3d::Map(theta_.data() + 3 * i); }
  /// Computes the forces of all atoms, 3A [N]: 0 for those that are not in atoms().
  void allForces_N(std::span<double> forces) const;
  /// Returns force and moment about the origin [N, N m], of patches at the places of then. Needs solve() alone, as do
  /// the functions below.
  Wrench wrench() const;
  /// Adds the part of the extra unknowns to the forces of the points [N] and to the couples [N m]: 3 (P + kCouples).
  void addExtraForces_N(std::span<double> forces) const;
  /// Computes the covariance of some extra unknowns, row after row; its unit is 1, that of their prior.
  /// \param unknowns indices from 0 of at most kColumns of them
  /// \param covariance as many rows and columns as `unknowns` has elements
  void extraCovariance(std::span<const int> unknowns, std::span<double> covariance);
  /// Computes (B R Q)' v / n^2, by which displacements v change y, with n of make().
  /// \param column_px v, 2M, padded
  /// \param ofXi rank() elements
  void readColumn(const double* column_px, std::span<double> ofXi) const;
  /// Subtracts from the result of readColumn() the part of one coordinate.
  /// \param displacement_px v at this coordinate
  void subtractAt(int coordinate, double displacement_px, std::span<double> ofXi) const;
  /// Multiplies a vector by the covariance of xi after the last solve(), in place.
  /// \param ofXi rank() elements
  void multiplyCovariance(std::span<double> ofXi) const;
  /// Fills in the displacements that the last answer predicts where the picture has none.
  /// \param missing as in make(); the part of the extra unknowns is left out there
  /// \param added as in read()
  /// \param displacement_px 2M; other elements remain unchanged
  void complete(std::span<const int> missing, std::span<const int> added, std::span<float> displacement_px) const;

  // These implement Candidate, with the results of the last weigh().
  const std::array<double, kMotions>& motion() const override { return motion_; }
  double squaredResidual_px2() const override { return squaredResidual_; }
  void wrenchCovariance(std::array<double, 36>& covariance) override;
  void nodeDeviations_N(std::span<double> deviations) override;
  void covariance(std::span<const double> weights, std::span<const int> points, std::span<double> covariance) override;
  void leastVariances(std::span<const double> weights, std::span<const int> points,
                      std::span<double> variances) override;

  // What make() has made. Unchanged by answers.

  /// Returns the number of elements of xi.
  int rank() const { return rank_; }
  /// Returns n, the standard deviation of each coordinate then.
  double noise_px() const { return noise_px_; }
  /// Returns the indices of the atoms that act, of all A.
  std::span<const int> atoms() const { return atoms_; }
  /// Returns the lower triangular root of the prior covariance of the i-th of atoms() [N].
  const Block& root(int i) const { return roots_[i]; }
  struct Sharing {
    std::span<const int> atoms;      ///< indices in atoms()
    std::span<const double> shares;  ///< of the force of each
  };
  /// Returns which atoms act at a point, or at a couple, which is numbered after the points.
  Sharing sharing(std::size_t point) const {
    const std::size_t first = sharingFirst_[point], count = sharingFirst_[point + 1] - first;
    return {{sharing_.data() + first, count}, {shares_.data() + first, count}};
  }
  /// Returns the index of the first extra unknown in theta.
  int firstExtra() const { return 3 * static_cast<int>(atoms_.size()); }
  /// Returns the number of extra unknowns; 0 if the posterior had none.
  int extraCount() const { return extraCount_; }
  /// Returns the diagonal of Lambda, rank() elements, ascending.
  std::span<const double> lambda() const { return {lambda_.data(), static_cast<std::size_t>(rank_)}; }
  /// Returns B R Q / n at the missing coordinates of make(), a row of rank() elements for each, without the part of the
  /// extra unknowns.
  const Eigen::MatrixXd& seenWhereMissing() const { return seenWhereMissing_; }
  /// Returns Q', rank() x elements of theta: xi = Q' theta, and the mean of theta is Q xi.
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

// Computes the forces of only those nodes that carry a load.
//
// Most of the noise of a sum over all nodes comes from those that carry nothing. Two strongly filtered maps of all
// nodes show where something touches. They give every node a weight w in [0, 1], the scale of its expected force. It is
// continuous in the picture, so that no force jumps when a node is added or left out. With D = diag(w) over the nodes A
// with w > 0, the step minimises
//   |d - H_A D x - P m|^2 + lambda^2 |x|^2 + n^2 m' Q^-1 m,    f_A = D x
// over the coordinates that are not missing, by normal equations whose matrix elements come from Inverse::gram.
// lambda = n / tau, where tau is the expected force of a node.
#pragma once

#include "daemon/solve/hills.h"
#include "daemon/solve/inverse.h"
#include "sensor/gel.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace tractiond::solve {

/// Thread-bound. Allocates only when made.
class ContactStep final : public SolvedForces {
 public:
  /// More nodes than kMostNodes are not solved for; above kFewNodes the result begins to count for less.
  static constexpr int kMostNodes = 96;
  static constexpr int kFewNodes = 64;

  /// `inverse` must outlive it. \param nodes grid of the sensor that `inverse` was computed for
  ContactStep(const Inverse& inverse, const sensor::NodeGrid& nodes, const SolveOptions& options);

  /// Returns the number of amplitudes that find() needs.
  int modes() const { return modeForces_.rows(); }

  /// Finds the nodes that carry a load. Returns the weight that the result of solve() should have against the fit of
  /// all nodes: 1 if the contact is small, 0 if it is too large for solve(). \param amplitudes the first modes()
  /// elements of left' d [px], missing markers completed; errors below a thousandth of the noise have no effect
  double find(std::span<const double> amplitudes, double noise_px);

  /// Returns the nodes of the last find(), ascending; none: nothing touches.
  std::span<const int> nodes() const { return {nodes_.data(), nodes_.size()}; }

  /// Returns w of every node of the face, by the last find().
  std::span<const double> weights() const { return weight_; }

  /// Solves for the forces of nodes(), at most kMostNodes. Returns false if the equations could not be solved; the
  /// results below then have no meaning.
  /// \param displacement 2M [px], padded to the stride of the influence matrix, 0 where missing
  /// \param missing coordinates without a displacement \param squares sum of the squared displacements [px^2]
  /// \param expected prior mean of the forces of nodes() [N]: the penalty is then lambda^2 |x - D^-1 expected|^2
  /// \param stiffness factor of lambda
  bool solve(const double* displacement, std::span<const int> missing, double squares,
             std::span<const double> expected = {}, double stiffness = 1.0);

  // Results of the last solve().
  std::span<const double> forces() const { return {forces_.data(), 3 * nodes_.size()}; }  ///< of nodes() [N]
  std::span<const int> places() const override { return nodes(); }
  std::span<const double> forces_N() const override { return forces(); }
  const std::array<double, kMotions>& motion() const { return motion_; }  ///< m: u, v [px], scale [1], roll [rad]
  double squaredResidual() const { return squaredResidual_; }             ///< [px^2]
  double lambda() const { return lambda_; }                               ///< [px/N]

  // Terms of the equations.
  std::span<const double> products() const { return right_; }                 ///< D H'd of nodes(), then P'd
  std::span<const double> motionCoupling() const { return motionCoupling_; }  ///< H'P of all markers, 3N x 4
  std::span<const double> motionGram() const { return motionGram_; }          ///< P'P of all markers, 4 x 4

  /// Overwrites a linear functional of the forces, one coefficient for each of forces(), with the form that
  /// covariance() needs, after solve(). The array must hold kMostUnknowns elements.
  void prepare(double* functional) const;
  /// Returns the covariance of two prepared functionals [N^2].
  double covariance(const double* a, const double* b) const;
  /// Implements SolvedForces::covariances.
  void covariances(double* functionals, std::array<double, kColumns * kColumns>& result) const override;
  /// Computes the standard deviations of forces() by noise and prior [N]: as many elements as forces() has.
  void deviations(double* deviation);
  /// The most unknowns of the equations.
  static constexpr int kMostUnknowns = 3 * kMostNodes + kMotions;

  /// Returns the force of a node that is found in half of the frames: along the surface, and into it [N]. Median over
  /// all nodes, at the calibrated noise; computed by the constructor.
  std::array<double, 2> detectionLimit_N() const { return detectionLimit_N_; }

 private:
  /// A filtered map of the forces of all nodes, and its noise.
  struct Map {
    std::vector<double> filter;     ///< of each mode [N/px]
    int modes = 0;                  ///< those that matter
    std::vector<double> precision;  ///< N x 6, inverse covariance of a node's force at 1 px of noise, xx yy zz xy xz yz
    std::vector<double> force;      ///< 3N, padded
  };

  Map makeMap(double force_N, double faintest) const;
  std::array<double, 2> detectionLimit() const;
  void filter(Map& map, std::span<const double> amplitudes);
  void surety(const Map& map, std::vector<double>& result) const;
  static double length(const double* force, const double* precision);
  void weigh();
  void assemble(const double* displacement, std::span<const int> missing);

  const Inverse& inverse_;
  const SolveOptions options_;
  const int columns_, rows_;
  Map touch_, shape_;
  CoarseMatrix modeForces_;  ///< V' as far as the maps need it
  std::array<double, 2> detectionLimit_N_{};
  std::vector<double> motionCoupling_;  ///< 3N x 4: H'P
  std::vector<double> motionGram_;      ///< 4 x 4: P'P
  std::vector<double> motionModes_;     ///< 4 x 2M, padded: P' in double precision
  std::vector<int> everyMode_;
  std::vector<float> coefficients_;
  LineArray<float> sum_;
  // Of one frame, over all nodes: how sure in either map, how strong, the weight, and what the profile takes off it.
  std::vector<double> touchSurety_, shapeSurety_, magnitude_, strongNear_, weight_, faintness_, touchShare_, counted_;
  // Of one frame, over the found ones.
  std::vector<int> nodes_, unknowns_;
  std::vector<double> scale_;  ///< w of each unknown
  std::vector<double> matrix_, right_, solution_, prior_, forces_, missingRows_, variances_;
  LineArray<double> scratch_;
  std::array<double, kMotions> motion_{};
  double outlined_ = 0.0;  ///< how far the shape map counts
  double expected_N_ = 0.0, noise_px_ = 0.0, lambda_ = 0.0, squaredResidual_ = 0.0;
};

}  // namespace tractiond::solve

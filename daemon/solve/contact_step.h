// Forces for the nodes alone that carry something.
//
// Most of the noise of a sum over all nodes comes from those that carry nothing. Where something touches is seen in two
// strongly filtered maps of all nodes. They give every node a weight w in [0, 1], the scale of its expected force,
// continuous in the picture, so that nothing jumps when a node comes or goes. With D = diag(w) over the nodes A, w > 0:
//   minimise |d - H_A D x - P m|^2 + lambda^2 |x|^2 + n^2 m' Q^-1 m,    f_A = D x
// over the valid rows, by normal equations whose matrix is looked up. lambda = n / tau, tau the expected force of a
// node.
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
  /// More nodes than this are not solved for; above kFewNodes the result begins to count for less.
  static constexpr int kMostNodes = 96;
  static constexpr int kFewNodes = 64;

  ContactStep(const Inverse& inverse, const sensor::NodeGrid& nodes, const SolveOptions& options);

  /// How many of the picture's amplitudes find() wants.
  int modes() const { return modeForces_.rows(); }

  /// Finds the nodes from the picture's first amplitudes left' d (missing markers completed), a thousandth of the noise
  /// being as good as none. Returns the share that solve()'s result deserves: 1 if the contact is small, 0 if it is too
  /// large for solve().
  double find(std::span<const double> amplitudes, double noise_px);

  /// The nodes that find() found, rising; none: nothing touches.
  std::span<const int> nodes() const { return {nodes_.data(), nodes_.size()}; }

  /// w of every node of the face, of the last find().
  std::span<const double> weights() const { return weight_; }

  /// `displacement`: stride of the influence matrix, 0 where missing; `missing`: those coordinates; `squares`: the
  /// displacements' sum of squares. False: the equations could not be solved. With `expected` forces of nodes() [N] the
  /// penalty is lambda^2 |x - D^-1 expected|^2, and lambda `stiffness` times what it is otherwise.
  bool solve(const double* displacement, std::span<const int> missing, double squares,
             std::span<const double> expected = {}, double stiffness = 1.0);

  // What solve() found.
  std::span<const double> forces() const { return {forces_.data(), 3 * nodes_.size()}; }  ///< of nodes() [N]
  std::span<const int> places() const override { return nodes(); }
  std::span<const double> forces_N() const override { return forces(); }
  const std::array<double, kMotions>& motion() const { return motion_; }
  double squaredResidual() const { return squaredResidual_; }  ///< [px^2]
  double lambda() const { return lambda_; }                    ///< [px/N]

  // What it was found from: weights times H'd of nodes(), then P'd; H'P, 3N x 4, and P'P of all markers.
  std::span<const double> products() const { return right_; }
  std::span<const double> motionCoupling() const { return motionCoupling_; }
  std::span<const double> motionGram() const { return motionGram_; }

  /// `functional` has an element for each of forces(), and is overwritten by what covariance() wants.
  void prepare(double* functional) const;
  /// Of two prepared functionals of the forces [N^2].
  double covariance(const double* a, const double* b) const;
  /// Of kColumns functionals of the forces, stored force after force and overwritten: row after row [N^2].
  void covariances(double* functionals, std::array<double, kColumns * kColumns>& result) const override;
  /// Standard deviations of forces() [N].
  void deviations(double* deviation);
  /// Unknowns: what a functional's memory must hold.
  static constexpr int kMostUnknowns = 3 * kMostNodes + kMotions;

  /// Force of a node that is found in half of the frames: along the surface, and into it [N].
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

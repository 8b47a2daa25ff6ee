// Template of a marker, and the weights that compute its place from the samples around it.
//
// A marker is a disc blurred by a Gaussian, T(r). Near the place c its window of n samples is
//   I = b + s . (x - c) + a T(|x - c|) + a d . grad_c T + e laplacian(T),
// linear in b, the slope s, a, a d, and e, which stands for more or less blur. For every 1/8 sample of c the functions
// T, dT/du, dT/dv, laplacian, x, y are made orthonormal to each other and to the constant, in this order: six rows of n
// weights. Amplitude a, offset d, slope and residual follow from their dot products with the window; e is of no
// interest but keeps a lens out of focus from being taken for a slope or an odd shape. This is least squares; for white
// noise and a known slope it reaches the Cramer-Rao bound (docs/mathematics.md, 3).
#pragma once

#include <Eigen/Core>

#include <array>
#include <vector>

namespace tractiond::track {

/// Immutable after construction; reentrant. Lengths are in samples of the marker's colour plane.
class MarkerTemplate {
 public:
  static constexpr int kPhases = 8;    ///< per sample and direction
  static constexpr int kLanes = 16;    ///< a window is padded with zeros to a multiple of this
  static constexpr int kMaxHalf = 12;  ///< of the widest window
  static constexpr int kRows = 6;      ///< of weights
  using Functions = Eigen::Matrix<double, 1, 1 + kRows>;
  using Triangle = Eigen::Matrix<double, 1 + kRows, 1 + kRows>;

  /// From dot products p0 ... p5 to the slope of the surroundings, s_u = t0 p4 + t1 p5, s_v = t2 p5, and to
  /// (a, a d_u, a d_v) = S (p0, p1, p2) - L (s_u, s_v), S = [s0 s1 s2; 0 s3 s4; 0 0 s5], L = [l0 l1; l2 l3; l4 l5].
  struct Phase {
    std::array<float, 6> solve;       ///< S
    std::array<float, 3> solveSlope;  ///< t
    std::array<float, 6> lean;        ///< L
    float variance;       ///< of d_u and of d_v (their mean) for unit noise and a = 1, if the slope is known
    float slopeVariance;  ///< of s_u and of s_v (their mean) for unit noise
    float slopeShare;     ///< what is added to `variance` if the slope is the window's own
    float cover;          ///< mean of T over the window
  };

  /// Makes a template without a window, which must not be used for a fit.
  MarkerTemplate() = default;

  /// Computes the tables: allocates.
  /// \param radius above 0; cut to largestRadius()
  /// \param blur standard deviation of the Gaussian, the sample's own width included, above 0; a wide one does not
  /// widen the window beyond kMaxHalf
  MarkerTemplate(double radius, double blur);

  /// Returns the largest radius that a template can have [samples].
  static double largestRadius() { return kMaxHalf - 3.0; }

  double radius() const { return radius_; }  ///< Returns the radius that is used [samples].
  /// Returns half the width of the window, 3 to kMaxHalf; it spans floor(c) - half + 1 ... floor(c) + half in both
  /// directions.
  int half() const { return half_; }
  int used() const { return 4 * half_ * half_; }        ///< Returns the window's number of samples without padding.
  int samples() const { return paddedSamples(half_); }  ///< Returns it with padding.
  /// Returns the number of floats from one row of such a window to the next. Of 6 samples a row takes 8: the window is
  /// padded to as many anyway.
  static constexpr int rowLength(int half) { return half == 3 ? 8 : 2 * half; }
  /// Returns the number of samples, with padding, of a window of this half width.
  static constexpr int paddedSamples(int half) { return (4 * half * half + kLanes - 1) / kLanes * kLanes; }
  /// Returns the phase of a centre; valid as long as this.
  /// \param index (8ths of a sample down) * kPhases + (8ths of a sample across), each from 0 to kPhases - 1
  const Phase& phase(int index) const { return phases_[index]; }
  /// Returns the weights of a phase: kRows rows of samples() numbers, each the window row by row; the padding is 0.
  /// Valid as long as this.
  /// \param index as for phase()
  const float* weights(int index) const { return weights_.front().lane + index * kRows * samples(); }

  /// Returns T at distance r, not below 0 [samples]: 1 within a large disc; 0 far outside the window.
  double at(double r) const;

  /// Returns the values of the constant, T, -dT/dx, -dT/dy, laplacian(T), x and y at (x, y) [samples] from the marker's
  /// centre.
  Functions functionsAt(double x, double y) const;

  /// Returns the derivatives of T at (x, y) [samples] from the centre by what deforms the disc: by its radius, and by
  /// the two directions in which an ellipse is elongated.
  Eigen::Matrix<double, 1, 3> deformationsAt(double x, double y) const;

  /// Returns the phase of a window, without `cover`.
  /// \param triangle upper triangular QR factor of functionsAt() over the window
  static Phase phaseOf(const Triangle& triangle);

 private:
  struct alignas(64) Line {
    float lane[kLanes];
  };

  double radius_ = 0.0;
  int half_ = 0;
  std::vector<double> profile_;
  std::vector<Line> weights_;
  std::vector<Phase> phases_;
};

}  // namespace tractiond::track

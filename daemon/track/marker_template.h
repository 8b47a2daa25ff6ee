// The appearance of a marker, and the weights that determine its place from the samples around it.
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
  static constexpr int kLanes = 8;     ///< a row of the window is padded with zeros to a multiple of this
  static constexpr int kMaxHalf = 12;  ///< of the widest window
  static constexpr int kMaxSamples = 2 * kMaxHalf * 3 * kLanes;
  static constexpr int kRows = 6;  ///< of weights
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

  MarkerTemplate() = default;

  /// `blur` is the standard deviation of the Gaussian, the sample's own width included. Radii above largestRadius() are
  /// cut to it: the window does not grow further.
  MarkerTemplate(double radius, double blur);

  static double largestRadius() { return kMaxHalf - 3.0; }

  double radius() const { return radius_; }
  int half() const { return half_; }      ///< the window spans floor(c) - half + 1 ... floor(c) + half
  int chunks() const { return chunks_; }  ///< of kLanes, per row
  int samples() const { return 2 * half_ * chunks_ * kLanes; }    ///< with padding; a multiple of 16
  int used() const { return 4 * half_ * half_; }                  ///< without
  const float* mask() const { return mask_.data(); }              ///< of a row's last chunk: 1 used, 0 padding
  const Phase& phase(int index) const { return phases_[index]; }  ///< index = down * kPhases + across
  const float* weights(int index) const { return weights_.front().lane + index * kRows * samples(); }

  /// Returns T at distance r; 0 beyond the window.
  double at(double r) const;

  /// Returns the constant, T, -dT/dx, -dT/dy, laplacian(T), x and y at (x, y) [samples] from the marker's centre.
  Functions functionsAt(double x, double y) const;

  /// Returns the derivatives of T at (x, y) [samples] from its centre by the disc's radius, and by its elongation to an
  /// ellipse in two directions.
  Eigen::Matrix<double, 1, 3> deformationsAt(double x, double y) const;

  /// Returns the phase, without `cover`, of a window in which functionsAt() has the QR factor `triangle` (upper
  /// triangular).
  static Phase phaseOf(const Triangle& triangle);

 private:
  struct alignas(64) Line {
    float lane[16];
  };

  double radius_ = 0.0;
  int half_ = 0, chunks_ = 0;
  std::array<float, kLanes> mask_{};
  std::vector<double> profile_;
  std::vector<Line> weights_;
  std::vector<Phase> phases_;
};

}  // namespace tractiond::track

// What a marker looks like, and the weights that read its place from the samples around it.
//
// A marker is a disc blurred by a Gaussian, T(r). Near the place c its window of n samples is
//   I = b + a T(|x - c|) + a d . grad_c T,
// linear in b, a, a d_u, a d_v. For every 1/8 sample of c the functions T, dT/du, dT/dv are made orthonormal to each
// other and to the constant: three rows of n weights. Amplitude a, offset d and residual follow from their dot products
// with the window. That is least squares; for white noise it reaches the Cramer-Rao bound (docs/mathematics.md, 3).
#pragma once

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

  /// From dot products (p0, p1, p2) to a = s0 p0 + s1 p1 + s2 p2, a d_u = s3 p1 + s4 p2, a d_v = s5 p2.
  struct Phase {
    std::array<float, 6> solve;
    float variance;  ///< of d_u and of d_v (their mean) for unit noise and a = 1
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
  const float* weights(int index) const { return weights_.front().lane + index * 3 * samples(); }

  /// T at distance r; 0 beyond the window.
  double at(double r) const;

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

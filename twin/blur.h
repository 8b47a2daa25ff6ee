// Round markers as pixels record them: blurred by a Gaussian and averaged over each pixel's square.
#pragma once

#include <span>
#include <vector>

namespace twin {

/// A strip of a region: x0 <= x <= x1, of height dy, centred on y. In pixels.
struct Strip {
  double y, dy, x0, x1;
};

/// Returns an ellipse around (0, 0) as strips, top to bottom: at least 64, each at most 0.8 px high for half axes up to
/// 10^5 px. Their total area is exactly the ellipse's.
/// \param a, b half axes [px], above 0
/// \param angle of the first half axis, from the x axis towards the y axis [rad]
std::vector<Strip> ellipseStrips(double a, double b, double angle);

/// Applies Gaussian point spread and pixel square as one separable kernel. Immutable after construction and reentrant.
class Blur {
 public:
  /// \param sigma_px standard deviation of the Gaussian; 0: no blur
  explicit Blur(double sigma_px);

  /// Returns the distance from a pixel's centre beyond which a region adds no light to the pixel [px]: 4 sigma + 0.5.
  double reach() const { return reach_; }

  /// Adds `gain` times the brightness of a region to size x size pixels, row by row; the centre of the first pixel is
  /// (left, top), in the coordinates of the region. A pixel that the region covers fully has brightness 1. `pixels`
  /// has at least size x size elements (asserted).
  void add(std::span<const Strip> region, double left, double top, int size, double gain,
           std::span<float> pixels) const;

 private:
  /// Interpolates a table at an offset [px].
  double at(const std::vector<double>& table, double offset) const;

  double reach_;
  std::vector<double> kernel_;    ///< brightness of a pixel at an offset from a line of light
  std::vector<double> integral_;  ///< of the kernel, from -reach to the offset
};

}  // namespace twin

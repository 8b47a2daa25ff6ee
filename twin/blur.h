// Round markers as pixels see them: blurred by a Gaussian and averaged over each pixel's square.
#pragma once

#include <span>
#include <vector>

namespace twin {

constexpr int kLargestPatch = 64;  ///< [px]

/// A strip of a region: x0 <= x <= x1, dy high, around y. Pixels.
struct Strip {
  double y, dy, x0, x1;
};

/// The disc around (0, 0), as strips whose areas add up to exactly its own.
std::vector<Strip> discStrips(double radius);

/// The same of an ellipse with these half axes, the first of them at `angle` from the x axis towards the y axis.
std::vector<Strip> ellipseStrips(double a, double b, double angle);

/// Gaussian point spread and pixel square in one separable kernel. Reentrant; immutable after construction.
class Blur {
 public:
  /// sigma_px may be 0.
  explicit Blur(double sigma_px);

  /// Beyond this distance a region no longer brightens a pixel's centre [px].
  double reach() const { return reach_; }

  /// Adds `gain` times the brightness of the region to `size` x `size` pixels, row after row, the first of which is
  /// centred on (left, top). Full cover is 1.
  void add(std::span<const Strip> region, double left, double top, int size, double gain,
           std::span<float> pixels) const;

 private:
  double at(const std::vector<double>& table, double offset) const;

  double reach_;
  std::vector<double> kernel_;    ///< brightness of a pixel at an offset from a line of light
  std::vector<double> integral_;  ///< of the kernel, from -reach to the offset
};

}  // namespace twin

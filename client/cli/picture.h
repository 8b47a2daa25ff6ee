// The live view: the field as arrows on shades, and beside it the numbers.
#pragma once

#include "client/cli/canvas.h"
#include "client/cli/scene.h"

namespace traction::cli {

/// The force that is drawn brightest: 1, 2 or 5 times a power of ten, not below the strongest. It rises at once and
/// falls after two seconds, so that the picture does not flicker.
class Scale {
 public:
  /// \param strongest_N that is to be drawn now
  /// \param smallest_N below which there is noise
  double update(double strongest_N, double smallest_N, std::int64_t now_ns);

 private:
  double scale_N_ = 0.0;
  std::int64_t needed_ns_ = 0;  ///< when it was last needed
};

/// A page of the given size. Every size from 20 x 8 on shows the field; more room shows more numbers.
Canvas draw(const Scene& scene, int width, int height, Scale& scale, std::int64_t now_ns, std::string_view endpoint);

/// One line for a terminal that is none.
std::string summary(const Scene& scene, std::int64_t now_ns);

}  // namespace traction::cli

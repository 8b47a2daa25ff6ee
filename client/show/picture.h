// The live view: the field as arrows on shades, with figures beside it.
#pragma once

#include "client/show/canvas.h"
#include "client/show/scene.h"

namespace traction::client {

/// The force of full brightness: 1, 2 or 5 times a power of ten, at least the strongest force. It rises at once and
/// falls after two seconds, so that the picture does not flicker.
class Scale {
 public:
  /// Takes the strongest force of the next page and returns the force of full brightness for it [N].
  /// \param strongest_N strongest force to draw
  /// \param smallest_N force below which there is only noise; above 0
  /// \param now_ns CLOCK_MONOTONIC
  double update(double strongest_N, double smallest_N, std::int64_t now_ns);

 private:
  double scale_N_ = 0.0;
  std::int64_t needed_ns_ = 0;  ///< when the current value was last needed
};

/// Draws a page of width x height characters. From 20 x 8 on it shows the field; larger pages show more figures. Reads
/// the system clock for the age of the zero.
/// \param scale kept by the caller from page to page
/// \param now_ns CLOCK_MONOTONIC
/// \param endpoint to show
Canvas draw(const Scene& scene, int width, int height, Scale& scale, std::int64_t now_ns, std::string_view endpoint);

/// Returns one line without a line end, for output that is not a terminal: rate, resultant or why there is none,
/// latency, losses and what is doubtful.
/// \param now_ns CLOCK_MONOTONIC
std::string summary(const Scene& scene, std::int64_t now_ns);

}  // namespace traction::client

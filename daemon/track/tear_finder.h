// Pictures that do not hang together: rows of another moment, or moved aside.
#pragma once

#include "daemon/track/lattice.h"

#include <span>
#include <vector>

namespace tractiond::track {

/// Thread-bound. Allocates only in the constructor.
class TearFinder {
 public:
  explicit TearFinder(const std::vector<Lattice>& lattices);

  /// The next frame's displacements of all layers. True: it is torn across, between two rows of markers with at least
  /// three on either side, by half a pixel or more. A torn frame is no reference for the next one,
  /// unless three were torn running.
  bool torn(std::span<const Vector> displacement_px, std::span<const float> variance_px2,
            std::span<const std::uint8_t> valid);

  /// After a gap: the next frame is compared with nothing.
  void forget() { known_ = false; }

  /// Of the last whole frame.
  std::span<const Vector> reference_px() const { return reference_; }
  std::span<const std::uint8_t> referenceValid() const { return referenceValid_; }

 private:
  enum class Step : std::uint8_t { kUnknown, kNone, kFaint, kClear, kPlain };

  void markSteps(const Lattice& lattice, std::span<const float> variance_px2, std::span<const std::uint8_t> valid);
  bool anyStep() const;
  bool losesRows(const Lattice& lattice, std::span<const std::uint8_t> valid) const;

  std::vector<Lattice> lattices_;
  std::vector<Vector> reference_, increment_;
  std::vector<float> referenceVariance_;
  std::vector<std::uint8_t> referenceValid_;
  std::vector<Step> steps_;  ///< of each layer's gaps, rows_ per layer
  int rows_ = 0;             ///< most of a layer
  bool known_ = false;
  int running_ = 0;  ///< torn frames
};

}  // namespace tractiond::track

// Detects torn pictures, of which some rows belong to another moment, or are shifted.
#pragma once

#include "daemon/track/lattice.h"

#include <span>
#include <vector>

namespace tractiond::track {

/// Thread-bound. Allocates only in the constructor.
class TearFinder {
 public:
  explicit TearFinder(const std::vector<Lattice>& lattices);

  /// Adds the displacements of all layers in the next frame. Returns whether it is torn, by half a pixel or more,
  /// between two rows of markers with at least three rows on either side. A torn frame does not serve as the reference
  /// of the next one, unless three in a row were torn.
  bool torn(std::span<const Vector> displacement_px, std::span<const float> variance_px2,
            std::span<const std::uint8_t> valid);

  /// Must be called after a gap: the next frame is not compared.
  void forget() { known_ = false; }

  // Of the last intact frame.
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
  std::vector<Step> steps_;  ///< between rows of each layer, rows_ per layer
  int rows_ = 0;             ///< largest number of rows of a layer
  bool known_ = false;
  int running_ = 0;  ///< torn frames in a row
};

}  // namespace tractiond::track

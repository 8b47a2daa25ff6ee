// Finds torn pictures: some rows are of another moment, or shifted.
#pragma once

#include "daemon/track/lattice.h"

#include <span>
#include <vector>

namespace tractiond::track {

/// Thread-bound. Allocates only in the constructor.
class TearFinder {
 public:
  /// \param lattices of all layers (latticesOf()); need not outlive this
  explicit TearFinder(const std::vector<Lattice>& lattices);

  /// Returns whether the next frame is torn: between two rows of markers, with at least three rows on either side, the
  /// displacements of all layers step by more than their noise and more than 0.1 px (a step of half a pixel is always
  /// found, smaller ones mostly), or the rows on one side have vanished. A frame that is not torn becomes the reference
  /// for the next one; the first one has none and is not torn. After three torn frames in a row the next frame counts
  /// as not torn.
  /// \param displacement_px, variance_px2, valid by marker, of all layers
  bool torn(std::span<const Vector> displacement_px, std::span<const float> variance_px2,
            std::span<const std::uint8_t> valid);

  /// Forgets the reference, after a gap: the next frame is not compared, and not torn.
  void forget() { known_ = false; }

  // Return the displacements [px] in the last frame that was not torn, and which of them are valid, by marker. The
  // spans stay in place; before the first frame they have no meaning.
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

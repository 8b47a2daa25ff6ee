// Computes products of atoms with each other, with the motion and with a picture, over the coordinates that are not
// missing: B'B and B'd of the normal equations with B = [P Q^1/2, H].
//
// The products of an atom are computed when it is first added; all posteriors of a frame share them.
#pragma once

#include "daemon/solve/factors.h"

#include <span>
#include <vector>

namespace tractiond::solve {

/// The displacements of one frame. Borrowed.
struct Displacements {
  const double* displacement_px = nullptr;  ///< 2M, padded; 0 where missing
  std::span<const int> missing;             ///< coordinates without a displacement
  double squares_px2 = 0.0;                 ///< sum of the squared displacements
  double noise_px = 0.0;                    ///< n, above 0
  std::span<const float> rounded_px;        ///< 2M: the same displacements, which the modes are read from
};

/// Thread-bound. Allocates only when made.
class AtomProducts {
 public:
  /// Makes room for the products of `most` atoms. `factors` must outlive it.
  AtomProducts(const Factors& factors, int most);

  /// Starts anew with a picture, which must live until the next begin().
  void begin(const Displacements& picture);

  /// Computes the products among these atoms, at most `most`, that are not known yet. Discards those of other atoms if
  /// there is no room.
  void add(std::span<const int> atoms);

  /// Returns the index of the first of the three components of an atom that was added; -1 if there are no products of
  /// it. The next add() may change it. The components of the motion have the indices 0 .. kMotions - 1.
  int indexOf(int atom) const { return index_[atom]; }
  /// Returns the products of a component with all others, by their indices [px^2/N^2; with the motion px^2/N, px^2].
  /// Valid until the next add() or begin().
  const double* row(int index) const { return products_.data() + static_cast<std::ptrdiff_t>(index) * stride_; }
  /// Returns the product of a component with the displacements [px^2/N; of the motion px^2].
  double withPicture(int index) const { return withPicture_[index]; }

 private:
  void forget();
  void addAtom(int atom);
  void takeOut(int first);
  /// Panel of kColumns components at the missing coordinates.
  double* panel(int number) {
    return missing_.data() + static_cast<std::ptrdiff_t>(number) * kColumns * factors_.coordinateCount();
  }

  const Factors& factors_;
  const int stride_;
  const Displacements* picture_ = nullptr;
  int size_ = 0;                    // components
  std::vector<int> atoms_, index_;  // atoms with products; A: index of an atom's first component, or -1
  LineArray<double> products_;      // stride x stride
  LineArray<double> missing_;       // panels
  std::vector<double> withPicture_;
};

}  // namespace tractiond::solve

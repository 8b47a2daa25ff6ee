// Finds how far the shear under a round contact is spread, compared with the pressure. A round patch carries both
// alike; where a ball sticks, its shear lies farther out (Cattaneo 1938, Mindlin 1949). One more unknown e for each
// patch, the excess of the shear's spread over the pressure's, is added to a linear posterior after the fact:
//
//   v = F_x du_x/ds + F_y du_y/ds        u: displacements by a unit of shear, s: spread
//   b = v'(d - B theta) / n^2,  K = v'v / n^2 - v'B cov(theta) B'v / n^4     what the picture says of e beyond theta
//   e ~ N(b / (K + 1 / p^2), 1 / (K + 1 / p^2)),  p: its prior deviation, the spread itself
// The other unknowns stay as they are: the spread of the pressure would change by a few hundredths of e.
#pragma once

#include "daemon/solve/freed_patches.h"
#include "daemon/solve/linear_posterior.h"

#include <array>
#include <span>

namespace tractiond::solve {

/// Thread-bound; make() and find() may be called by different threads, one after the other.
class ShearSpread {
 public:
  explicit ShearSpread(const Factors& factors);  ///< of the posteriors

  /// Prepares for the patches of a posterior. \param fit of these patches \param missing coordinates of its picture
  void make(const LinearPosterior& posterior, const FreedPatches& patches, const RoundPatches& fit,
            std::span<const int> missing);

  /// Returns e of a patch. \param now the patch by the posterior's last answer \param displacement_px of the picture
  /// without the curves, 0 where missing \param added as given to LinearPosterior::read()
  ShearExcess find(const LinearPosterior& posterior, int patch, const RoundPatch& now, const double* displacement_px,
                   double noise_px, std::span<const int> added);

 private:
  /// Of a patch, by a unit of shear along x and along y.
  struct Slopes {
    std::array<LineArray<double>, 2> px_m2;   ///< du/ds, 2M, padded
    std::array<std::vector<double>, 2> ofXi;  ///< (B R Q)' du/ds / n^2
    Eigen::Matrix2d products = Eigen::Matrix2d::Zero();
  };

  const int coordinates_;
  std::array<Slopes, static_cast<std::size_t>(RoundPatches::kMost)> slopes_;
  std::vector<double> ofXi_, shared_;
};

}  // namespace tractiond::solve

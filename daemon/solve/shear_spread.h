// Finds how far the shear under a round contact is spread, compared with the pressure. A round patch carries both
// alike; where a ball sticks, its shear lies farther out (Cattaneo 1938, Mindlin 1949). One more unknown e for each
// patch, the excess of the shear's spread over the pressure's, is added to a linear posterior after the fact:
//
//   v = F_x du_x/ds + F_y du_y/ds        u: displacements by a unit of shear, s: spread
//   b = v'(d - B theta) / n^2,  K = v'v / n^2 - v'B cov(theta) B'v / n^4     what the picture says of e beyond theta
//   e ~ N(b / (K + 1 / p^2), 1 / (K + 1 / p^2)),  p: its prior deviation, the spread itself
//   theta(e) = theta - e cov(theta) B'v / n^2         what the others are then
//
// Patch and atoms share the load of a contact, and the wider it is the more the atoms have. So the ratio is that of all
// that acts at the patch, with half the second moments M about its centre, of shear and of pressure:
//   R = (M_shear + e F_shear) / sum of shear / (M_pressure / sum of pressure),   of theta(e)
// It is linear in e and theta about e = 0 in its logarithm; both make its deviation.
#pragma once

#include "daemon/solve/freed_patches.h"
#include "daemon/solve/linear_posterior.h"

#include <array>
#include <span>

namespace tractiond::solve {

/// Thread-bound; make() and find() may be called by different threads, one after the other.
class ShearSpread {
 public:
  /// Allocates for the posteriors of these factors and atoms. `atoms` must outlive it.
  ShearSpread(const Factors& factors, const Atoms& atoms);

  /// Prepares for the patches of a posterior. The arguments need not outlive the call.
  /// \param patches those that the posterior frees
  /// \param fit that has found these patches
  /// \param missing coordinates without a displacement in the picture of LinearPosterior::make()
  void make(const LinearPosterior& posterior, const FreedPatches& patches, const RoundPatches& fit,
            std::span<const int> missing);

  /// Returns R of a patch with its standard deviation. The ratio is unknown (deviation 0) if the patch is a
  /// point, its shear or its pressure is not above 0, or the result is not finite.
  /// \param posterior that of make(), after weigh() of this picture
  /// \param freed as `patches` in make()
  /// \param now places and loads of all patches by this answer
  /// \param patch index in `now`
  /// \param grown load of this patch now, as a multiple of that in make()
  /// \param displacement_px of the picture without the curves, 2M, padded; 0 where missing
  /// \param noise_px as given to LinearPosterior::read()
  /// \param added as given to LinearPosterior::read()
  SpreadRatio find(const LinearPosterior& posterior, const FreedPatches& freed, std::span<const RoundPatch> now,
                   int patch, double grown, const double* displacement_px, double noise_px, std::span<const int> added);

 private:
  /// Of a patch, by a unit of shear along x and along y.
  struct Slopes {
    std::array<LineArray<double>, 2> px_m2;   ///< du/ds, 2M, padded
    std::array<std::vector<double>, 2> ofXi;  ///< (B R Q)' du/ds / n^2
    Eigen::Matrix2d products = Eigen::Matrix2d::Zero();
  };

  struct Excess {
    double value_m2, variance_m4;
  };
  Excess excess(const LinearPosterior& posterior, int patch, const RoundPatch& now, const double* displacement_px,
                double noise_px, std::span<const int> added);
  void weighPoints(std::span<const RoundPatch> now, int patch);

  const Atoms& atoms_;
  const int coordinates_;
  std::array<Slopes, RoundPatches::kMost> slopes_;
  std::vector<double> ofXi_, shared_;
  std::vector<double> away_m2_;  ///< of each point of the patch's contact half its squared distance; else -1
  std::vector<std::array<double, 2>> shares_;  ///< of each atom: the share at the contact, its second moment
};

}  // namespace tractiond::solve

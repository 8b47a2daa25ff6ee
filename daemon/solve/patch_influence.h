// Computes the displacements by a round contact of any place and size (docs/mathematics.md, 4.4).
//
// The contact is replaced by point forces at its centre and on a ring around it, whose shares reproduce the moments of
// the pressure of a ball up to the fifth; the ring carries the torsion, too. Their displacements in a half-space are
// exact. The difference between block and half-space is smooth: it is interpolated by cubics
// between the points of the atoms' grid.
#pragma once

#include "daemon/solve/factors.h"

#include <array>
#include <optional>

namespace tractiond::solve {

/// Where a round patch lies on the surface, and how wide it is.
struct PatchPlace {
  double x_m = 0.0, y_m = 0.0;  ///< centre, gel frame
  /// Variance of the pressure's places along any direction; for a ball, radius of the contact^2 / 5. A fit may make it
  /// slightly negative, which counts as 0.
  double spread_m2 = 0.0;
};

/// Returns the i-th number of a place: x, y, spread.
inline double& element(PatchPlace& place, int i) {
  return i == 0 ? place.x_m : i == 1 ? place.y_m : place.spread_m2;
}

/// Force x, y, z [N] and torsion about the centre of the patch [N m].
using PatchLoad = Eigen::Vector4d;
inline constexpr int kPatchLoads = 4, kPatchPlaces = 3;  ///< numbers of a PatchLoad, of a PatchPlace

/// Thread-bound. Allocates only when made.
class PatchInfluence {
 public:
  /// Returns whether the atoms are those of a block with at least 6 x 6 points; a body from a file has no half-space.
  static bool possible(const Atoms& atoms);

  /// `atoms` and `factors` must outlive it; `sensor` is used by the constructor only.
  PatchInfluence(const sensor::Sensor& sensor, const Atoms& atoms, const Factors& factors);

  /// Returns the number of elements of a column: 2M, padded.
  int stride() const { return factors_.influence.stride(); }

  /// Computes the displacements by a unit of each component of a load [px/N, px/(N m)]: kPatchLoads columns of stride()
  /// elements, column after column; what pads them is 0. A place outside the grid of points is extrapolated.
  void columns(const PatchPlace& place, double* columns);

  /// Computes the displacements by a load [px]: one column of stride() elements.
  void displacement(const PatchPlace& place, const PatchLoad& load, double* column);
  /// Computes the same of a half-space, in single precision and a fraction of the time: enough for slopes, as what the
  /// block adds is smooth.
  void halfSpace(const PatchPlace& place, const PatchLoad& load, double* column) const;

 private:
  struct Source {
    double x_m = 0.0, y_m = 0.0;
    Eigen::Vector3d force_N = Eigen::Vector3d::Zero();
  };
  static constexpr int kRing = 6, kSources = 2 * kRing + 1, kWindow = 6;

  using Sources = std::array<Source, kSources>;

  /// Of the markers, padded: places, and slopes of the pixel over 4 pi G [px/m / Pa].
  template <typename Number>
  struct Optics {
    std::array<std::vector<Number>, 3> marker;
    std::array<std::vector<Number>, 6> slope;
  };

  std::span<const Source> sourcesOf(const PatchPlace& place, const PatchLoad& load, Sources& sources) const;
  template <typename Number>
  void addSources(const Optics<Number>& optics, std::span<const Source> sources, double* column) const;
  void addHalfSpace(std::span<const Source> sources, double* column) const;
  void addRoundedHalfSpace(std::span<const Source> sources, double* column) const;
  void addHalfSpaces(std::span<const Source> sources, double* columns) const;
  void addRest(const PatchPlace& place, std::span<const Source> sources, double* column);

  const Atoms& atoms_;
  const Factors& factors_;
  const double poissonRatio_;
  Optics<double> exactly_;
  Optics<float> rounded_;
  RowMatrix rest_;  // influence of the points less a half-space's, 3P x 2M
};

}  // namespace tractiond::solve

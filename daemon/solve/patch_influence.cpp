// Compiled so that the compiler vectorises the square root and the divisions of the half-space's closed form.
#include "daemon/solve/patch_influence.h"

#include "base/vector_clones.h"
#include "sensor/elastic/parallel.h"
#include "sensor/projection.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tractiond::solve {
namespace {

/// The ring's share of the force. With this share and the squared radius kRing2 times the spread, 2 / share, the
/// moments are those of a ball's pressure. Its torsion acts at the same squared radius, but at that of no less than
/// kLeastArm pitches^2.
constexpr double kRingShare = 0.7, kRing2 = 2.0 / kRingShare, kLeastArm = 0.05;

/// Markers that are computed at a time.
constexpr int kTogether = 64;

int paddedMarkers(int count) {
  return (count + kTogether - 1) / kTogether * kTogether;
}

#define TRACTION_INLINE __attribute__((always_inline)) inline

/// What the displacements at (x, y) from a force F on the surface are made of, times 4 pi G: Boussinesq, Cerruti.
///   (u, v) = straight (F_x, F_y) + (x, y) (along (x F_x + y F_y) + spread F_z),  w = tilt (x F_x + y F_y) + sink F_z
template <typename Number>
struct Terms {
  Number straight, along, spread, tilt, sink;
};

/// kappa = 1 - 2 nu.
template <typename Number>
TRACTION_INLINE Terms<Number> termsAt(Number kappa, Number x, Number y, Number z) {
  const Number r = std::sqrt(x * x + y * y + z * z);
  const Number both = Number{1} / (r * (r + z)), c = both * (r + z),
               d = both * r;  // 1 / r, 1 / (r + z) by one division
  const Number far = c * c * c, near = kappa * c * d, lean = z * far;
  return {c + near * r, far - near * d, lean - near, lean + near, z * lean + (Number{1} + kappa) * c};
}

/// Displacements of kTogether markers.
template <typename Number>
struct Moved {
  Number u[kTogether] = {}, v[kTogether] = {}, w[kTogether] = {};
};

/// Places of kTogether markers [m].
template <typename Number>
struct Markers {
  const Number *x, *y, *z;
};

template <typename Number>
TRACTION_INLINE Markers<Number> markersOf(const std::array<std::vector<Number>, 3>& markers, int first) {
  return {markers[0].data() + first, markers[1].data() + first, markers[2].data() + first};
}

/// Adds the displacements by a force at (x, y).
template <typename Number>
TRACTION_INLINE void addDisplacements(Number kappa, Number sourceX, Number sourceY, Number forceX, Number forceY,
                                      Number forceZ, const Markers<Number>& at, Moved<Number>& __restrict moved) {
  const Number* const __restrict markerX = at.x, * const __restrict markerY = at.y, * const __restrict markerZ = at.z;
  for (int i = 0; i < kTogether; ++i) {
    const Number x = markerX[i] - sourceX, y = markerY[i] - sourceY;
    const Terms<Number> terms = termsAt(kappa, x, y, markerZ[i]);
    const Number along = x * forceX + y * forceY, sideways = terms.along * along + terms.spread * forceZ;
    moved.u[i] += terms.straight * forceX + x * sideways;
    moved.v[i] += terms.straight * forceY + y * sideways;
    moved.w[i] += terms.tilt * along + terms.sink * forceZ;
  }
}

/// Adds those by a force along x, along y and along z, each of the same size, and by a force (twistX, twistY) along the
/// surface.
template <typename Number>
TRACTION_INLINE void addAllDisplacements(Number kappa, Number sourceX, Number sourceY, Number force, Number twistX,
                                         Number twistY, const Markers<Number>& at, Moved<Number>* __restrict moved) {
  const Number* const __restrict markerX = at.x, * const __restrict markerY = at.y, * const __restrict markerZ = at.z;
  for (int i = 0; i < kTogether; ++i) {
    const Number x = markerX[i] - sourceX, y = markerY[i] - sourceY;
    const Terms<Number> terms = termsAt(kappa, x, y, markerZ[i]);
    const Number straight = force * terms.straight, along = force * terms.along, spread = force * terms.spread,
                 tilt = force * terms.tilt, both = x * y * along, twist = x * twistX + y * twistY;
    moved[0].u[i] += straight + x * x * along;
    moved[0].v[i] += both;
    moved[0].w[i] += x * tilt;
    moved[1].u[i] += both;
    moved[1].v[i] += straight + y * y * along;
    moved[1].w[i] += y * tilt;
    moved[2].u[i] += x * spread;
    moved[2].v[i] += y * spread;
    moved[2].w[i] += force * terms.sink;
    moved[3].u[i] += terms.straight * twistX + x * (terms.along * twist);
    moved[3].v[i] += terms.straight * twistY + y * (terms.along * twist);
    moved[3].w[i] += terms.tilt * twist;
  }
}

/// Adds the displacements in the picture of the markers from `first` on, of `count` in all.
template <typename Number>
TRACTION_INLINE void project(const std::array<std::vector<Number>, 6>& slopes, const Moved<Number>& moved, int first,
                             int count, double* column) {
  Number across[kTogether], up[kTogether];
  const auto slope = [&](std::size_t i) { return slopes[i].data() + first; };
  for (int i = 0; i < kTogether; ++i) {
    across[i] = slope(0)[i] * moved.u[i] + slope(1)[i] * moved.v[i] + slope(2)[i] * moved.w[i];
    up[i] = slope(3)[i] * moved.u[i] + slope(4)[i] * moved.v[i] + slope(5)[i] * moved.w[i];
  }
  for (int i = 0; i < std::min(kTogether, count - first); ++i) {
    column[2 * (first + i)] += across[i];
    column[2 * (first + i) + 1] += up[i];
  }
}

/// Shares of four points side by side in a cubic at `at` between them.
std::array<double, 4> cubicShares(double at) {
  const double a = at, b = at - 1.0, c = at - 2.0, d = at - 3.0;
  return {b * c * d / -6.0, a * c * d / 2.0, a * b * d / -2.0, a * b * c / 6.0};
}

}  // namespace

bool PatchInfluence::possible(const Atoms& atoms) {
  return atoms.columns >= kWindow && atoms.rows >= kWindow;
}

PatchInfluence::PatchInfluence(const sensor::Sensor& sensor, const Atoms& atoms, const Factors& factors)
    : atoms_(atoms)
    , factors_(factors)
    , poissonRatio_(sensor.gel.poissonRatio)
    , rest_(3 * atoms.pointCount(), factors.coordinateCount()) {
  assert(possible(atoms));
  const sensor::Points markers = sensor::markerPositions(sensor);
  assert(2 * markers.cols() == factors.coordinateCount());
  const int size = paddedMarkers(static_cast<int>(markers.cols()));
  for (auto& each : exactly_.marker) each.assign(size, 1.0);
  for (auto& each : exactly_.slope) each.assign(size, 0.0);
  const double scale = (1.0 + poissonRatio_) / (2.0 * std::numbers::pi * sensor.gel.youngsModulus);  // 1 / 4 pi G
  const sensor::Projection projection(sensor.camera, sensor.gel.size.z());
  for (Eigen::Index m = 0; m < markers.cols(); ++m) {
    const Eigen::Matrix<double, 2, 3> jacobian = projection.jacobian(markers.col(m));
    for (int axis = 0; axis < 3; ++axis) {
      exactly_.marker[axis][m] = markers(axis, m);
      for (int i = 0; i < 2; ++i) exactly_.slope[3 * i + axis][m] = scale * jacobian(i, axis);
    }
  }
  const auto round = [](const std::vector<double>& from, std::vector<float>& to) {
    to.assign(from.begin(), from.end());
  };
  for (std::size_t i = 0; i < exactly_.marker.size(); ++i) round(exactly_.marker[i], rounded_.marker[i]);
  for (std::size_t i = 0; i < exactly_.slope.size(); ++i) round(exactly_.slope[i], rounded_.slope[i]);
  sensor::elastic::inParallel(atoms.pointCount(), [&](Eigen::Index point) {
    std::vector<double> column(stride());
    for (int axis = 0; axis < 3; ++axis) {
      std::fill(column.begin(), column.end(), 0.0);
      const Source source{atoms.points(0, point), atoms.points(1, point), Eigen::Vector3d::Unit(axis)};
      addHalfSpace({&source, 1}, column.data());
      const int i = 3 * static_cast<int>(point) + axis;
      const auto halfSpace = Eigen::RowVectorXd::Map(column.data(), rest_.columns());
      rest_.view().row(i) = (factors.influence.view().row(i).cast<double>() - halfSpace).cast<float>();
    }
  });
}

template <typename Number>
TRACTION_INLINE void PatchInfluence::addSources(const Optics<Number>& optics, std::span<const Source> sources,
                                                double* column) const {
  const auto number = [](double value) { return static_cast<Number>(value); };
  for (int first = 0; first < factors_.coordinateCount() / 2; first += kTogether) {
    const Markers<Number> markers = markersOf(optics.marker, first);
    Moved<Number> moved;
    for (const Source& source : sources) {
      addDisplacements(number(1.0 - 2.0 * poissonRatio_), number(source.x_m), number(source.y_m),
                       number(source.force_N[0]), number(source.force_N[1]), number(source.force_N[2]), markers, moved);
    }
    project(optics.slope, moved, first, factors_.coordinateCount() / 2, column);
  }
}

TRACTION_VECTOR_CLONES
void PatchInfluence::addHalfSpace(std::span<const Source> sources, double* column) const {
  addSources(exactly_, sources, column);
}

TRACTION_VECTOR_CLONES
void PatchInfluence::addRoundedHalfSpace(std::span<const Source> sources, double* column) const {
  addSources(rounded_, sources, column);
}

/// Adds, for sources that press and twist, four columns: the displacements by their forces into the gel, turned to x,
/// to y, and as they are, and by their forces along the surface.
TRACTION_VECTOR_CLONES
void PatchInfluence::addHalfSpaces(std::span<const Source> sources, double* columns) const {
  for (int first = 0; first < factors_.coordinateCount() / 2; first += kTogether) {
    const Markers<double> markers = markersOf(exactly_.marker, first);
    Moved<double> moved[kPatchLoads];
    for (const Source& source : sources) {
      addAllDisplacements(1.0 - 2.0 * poissonRatio_, source.x_m, source.y_m, source.force_N[2], source.force_N[0],
                          source.force_N[1], markers, moved);
    }
    for (std::ptrdiff_t i = 0; i < kPatchLoads; ++i) {
      project(exactly_.slope, moved[i], first, factors_.coordinateCount() / 2, columns + i * stride());
    }
  }
}

/// Adds what the block adds to the half-space: the sources' forces spread over points by cubics.
void PatchInfluence::addRest(const PatchPlace& place, std::span<const Source> sources, double* column) {
  const double pitch = atoms_.pitch_m;
  const Eigen::Vector2d origin = atoms_.points.col(0).head<2>();
  const std::array<int, 2> counts = {atoms_.columns, atoms_.rows};
  const auto inGrid = [&](double x, double y, int axis) { return ((axis == 0 ? x : y) - origin[axis]) / pitch; };
  std::array<int, 2> low{};
  for (int axis = 0; axis < 2; ++axis) {
    const int at = static_cast<int>(std::floor(inGrid(place.x_m, place.y_m, axis)));
    low[axis] = std::clamp(at - 2, 0, counts[axis] - kWindow);
  }
  std::array<Eigen::Vector3d, kWindow * kWindow> window;
  window.fill(Eigen::Vector3d::Zero());
  for (const Source& source : sources) {
    std::array<int, 2> first{};
    std::array<std::array<double, 4>, 2> share{};
    for (int axis = 0; axis < 2; ++axis) {
      const double at = inGrid(source.x_m, source.y_m, axis);
      first[axis] = std::clamp(static_cast<int>(std::floor(at)) - 1, low[axis], low[axis] + kWindow - 4);
      share[axis] = cubicShares(at - first[axis]);
      first[axis] -= low[axis];
    }
    for (int row = 0; row < 4; ++row) {
      for (int c = 0; c < 4; ++c) {
        window[(first[1] + row) * kWindow + first[0] + c] += share[1][row] * share[0][c] * source.force_N;
      }
    }
  }
  constexpr std::size_t kMost = 3UL * kWindow * kWindow;
  std::array<int, kMost> rows{};
  std::array<float, kMost> coefficients{};
  std::size_t used = 0;
  for (int i = 0; i < kWindow * kWindow; ++i) {
    const int point = (low[1] + i / kWindow) * atoms_.columns + low[0] + i % kWindow;
    for (int axis = 0; axis < 3; ++axis) {
      const double coefficient = window[i][axis];
      if (coefficient == 0.0) continue;
      rows[used] = 3 * point + axis;
      coefficients[used++] = static_cast<float>(coefficient);
    }
  }
  addRows(rest_, {rows.data(), used}, {coefficients.data(), used}, column);
}

/// Returns the points that a load acts at, in `sources`: the centre, and the ring, which the torsion shares unless the
/// patch is too narrow.
std::span<const PatchInfluence::Source> PatchInfluence::sourcesOf(const PatchPlace& place, const PatchLoad& load,
                                                                  Sources& sources) const {
  const double least_m2 = kLeastArm * square(atoms_.pitch_m);
  const double radius = std::sqrt(kRing2 * std::max(place.spread_m2, 0.0));
  const double arm = std::sqrt(kRing2 * std::max(place.spread_m2, least_m2));
  const bool shared = place.spread_m2 >= least_m2;
  std::size_t used = 0;
  const Eigen::Vector3d force = load.head<3>();
  const bool pushes = !force.isZero(0.0), twists = load[3] != 0.0;
  if (pushes) sources[used++] = {place.x_m, place.y_m, (1.0 - kRingShare) * force};
  for (int i = 0; i < kRing; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kRing, x = std::cos(angle), y = std::sin(angle);
    const Eigen::Vector3d push = kRingShare / kRing * force,
                          twist = load[3] / (kRing * arm) * Eigen::Vector3d(-y, x, 0.0);
    if (shared) {
      sources[used++] = {place.x_m + radius * x, place.y_m + radius * y, push + twist};
      continue;
    }
    if (pushes) sources[used++] = {place.x_m + radius * x, place.y_m + radius * y, push};
    if (twists) sources[used++] = {place.x_m + arm * x, place.y_m + arm * y, twist};
  }
  return {sources.data(), used};
}

void PatchInfluence::displacement(const PatchPlace& place, const PatchLoad& load, double* column) {
  Sources room;
  const auto sources = sourcesOf(place, load, room);
  std::fill_n(column, stride(), 0.0);
  addHalfSpace(sources, column);
  addRest(place, sources, column);
}

void PatchInfluence::halfSpace(const PatchPlace& place, const PatchLoad& load, double* column) const {
  Sources room;
  std::fill_n(column, stride(), 0.0);
  addRoundedHalfSpace(sourcesOf(place, load, room), column);
}

void PatchInfluence::columns(const PatchPlace& place, double* columns) {
  Sources room;
  std::fill_n(columns, std::ptrdiff_t{kPatchLoads} * stride(), 0.0);
  addHalfSpaces(sourcesOf(place, PatchLoad::Unit(2) + PatchLoad::Unit(3), room), columns);
  for (int i = 0; i < kPatchLoads; ++i) {
    addRest(place, sourcesOf(place, PatchLoad::Unit(i), room), columns + static_cast<std::ptrdiff_t>(i) * stride());
  }
}

}  // namespace tractiond::solve

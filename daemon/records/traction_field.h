// The solver's result for one frame: the content of the published field.
#pragma once

#include "daemon/records/marker_field.h"

namespace tractiond {

/// Covariance of force and moment (Fx, Fy, Fz, Mx, My, Mz), row after row [N^2, N^2 m, N^2 m^2].
using WrenchCovariance = std::array<double, 36>;

/// A region in which something touches. Deviations are standard deviations that noise alone causes.
struct Contact {
  std::array<double, 2> position_m{};  ///< centre of its normal forces; of all its forces if it does not press
  std::array<double, 2> positionDeviation_m{};
  std::array<double, 3> force_N{};
  std::array<double, 3> forceDeviation_N{};
  double area_m2 = 0.0;  ///< area of a uniform pressure of the same concentration
  double areaDeviation_m2 = 0.0;
  double positionZ_m = 0.0;           ///< z of that centre; of a block 0
  std::array<double, 3> moment_Nm{};  ///< about that centre, (position_m, positionZ_m)
  WrenchCovariance noise{};           ///< of force_N and moment_Nm: the part that differs from frame to frame
  WrenchCovariance systematic{};      ///< the part that does not
  /// Of the ellipse of an even pressure with this area and the second moments of the forces, the larger one first.
  std::array<double, 2> halfAxes_m{};
  std::array<double, 2> halfAxesDeviation_m{};
  double orientation_rad = 0.0;           ///< of the larger one, from x towards y, in [-pi/2, pi/2)
  double orientationDeviation_rad = 0.0;  ///< at most pi / sqrt(12), that of any orientation
  double spreadRatio = 0.0;               ///< of a round contact: mean squared distance of shear over that of pressure
  double spreadRatioDeviation = 0.0;      ///< 0: not known
  double hertzRadius_m = 0.0;             ///< of Hertz's pressure, where it is one round patch; else 0
  double hertzRadiusDeviation_m = 0.0;
};
inline constexpr int kMaxContacts = 8;  ///< largest number of contacts in a field

/// How the forces were found.
enum class Method : std::uint8_t {
  kNone,       ///< not valid
  kNoContact,  ///< nothing exceeds the detection limit: all forces are 0
  kContact,    ///< something touches
};

/// Whose model the forces were solved with.
enum class Solution : std::uint8_t {
  kNone,    ///< not valid
  kFull,    ///< of this frame
  kLinear,  ///< of an earlier frame, which this one does not contradict (docs/mathematics.md, 4.10)
};

/// What the solver did for a field (docs/mathematics.md, section 4).
struct SolverWork {
  int rounds = 0;           ///< rounds in which the prior of the atoms was fitted
  int atoms = 0;            ///< atoms with a force, without patches
  double patchShare = 0.0;  ///< probability that round patches explain the picture
  double evenShare = 0.0;   ///< probability that one contact presses evenly
  bool failed = false;      ///< the equations could not be solved, or a number is not finite: the field is not valid
};

/// Forces of the object on the gel, gel frame (x right, y up in the picture, z into the gel), SI. Sized once, reused.
struct TractionField {
  MarkerField markers;             ///< copy of the markers from which the forces were computed
  std::vector<float> force_N;      ///< 3 N, node after node (x, y, z)
  std::vector<float> deviation_N;  ///< 3 N, standard deviation of each that noise causes; 0: nothing touches
  bool valid = false;              ///< false: too few markers, a wrong gel file or a numeric failure; all are 0
  Method method = Method::kNone;
  Solution solution = Solution::kNone;
  std::uint64_t modelFrame = 0;                ///< number of that earlier frame; 0: none
  std::array<double, 3> resultant_N{};         ///< sum of the node forces
  std::array<double, 3> moment_Nm{};           ///< about the origin
  WrenchCovariance noise{};                    ///< of the two above: the part that differs from frame to frame
  WrenchCovariance systematic{};               ///< the part that does not: the gel file, force beyond the outer nodes
  std::array<double, 2> centreOfPressure_m{};  ///< of the normal forces
  bool centreOfPressureValid = false;          ///< false where the normal force is too small for a centre
  double residual_px = 0.0;                    ///< root mean square over the coordinates of the markers used
  std::array<double, 4> pictureMotion{};       ///< of the picture since the zero: u, v [px], scale [1], roll [rad]
  std::array<Contact, kMaxContacts> contacts{};
  int contactCount = 0;
  std::uint32_t flags = 0;
  SolverWork work;

  /// Sizes the arrays, also those of `markers`, and sets their elements, but nothing else, to 0.
  void resize(int markerCount, int nodeCount);
};

/// Returns a field with room for M markers and N nodes.
TractionField blankField(int markers, int nodes);

}  // namespace tractiond

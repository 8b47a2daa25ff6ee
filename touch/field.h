// What this room reads of a field, whatever message it came in. Gel frame, SI units.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace touch {

/// What the numbers of a field are relative to. The contacts of two fields are comparable if it is the same in both.
struct Basis {
  using Id = std::array<std::uint8_t, 16>;
  Id boot{};         ///< start of the daemon
  Id calibration{};  ///< what the forces are computed from
  Id zero{};         ///< what displacements are measured from
  friend bool operator==(const Basis&, const Basis&) = default;
};

/// Two 3 x 3 matrices, row by row: what differs from frame to frame, and what does not. The total is their sum.
struct Covariance {
  std::array<double, 9> noise{}, systematic{};
};

/// A contact as one field states it. Deviations are standard deviations that noise causes.
struct Observation {
  std::array<double, 2> position_m{};  ///< centre of its normal forces
  std::array<double, 2> positionDeviation_m{};
  std::array<double, 3> force_N{};  ///< shear (x, y) and normal force (z)
  std::array<double, 3> forceDeviation_N{};
  double area_m2 = 0.0;  ///< area of an even pressure as concentrated
  double areaDeviation_m2 = 0.0;
  /// Mean squared distance of its shear from its centre over that of its pressure. Deviation 0: not known.
  double spreadRatio = 0.0;
  double spreadRatioDeviation = 0.0;
  std::array<double, 3> moment_Nm{};  ///< about (position_m, positionZ_m); of a block, z is the torque about the normal
  double positionZ_m = 0.0;
  Covariance forceCovariance_N2{}, momentCovariance_N2m2{};
  Covariance forceMomentCovariance_N2m{};  ///< row: component of the force; column: of the moment
  std::array<double, 2> halfAxes_m{};      ///< the larger one first
  std::array<double, 2> halfAxesDeviation_m{};
  double orientation_rad = 0.0;           ///< of the larger one, from x towards y; as good as that plus pi
  double orientationDeviation_rad = 0.0;  ///< at most pi / sqrt(12): any orientation is possible
};

/// Returns the time between two, in double precision, as the times of fields may be any.
inline double seconds(std::int64_t from_ns, std::int64_t to_ns) {
  return 1e-9 * (static_cast<double>(to_ns) - static_cast<double>(from_ns));
}

/// Largest number of contacts in a field; further ones are not read.
inline constexpr int kMaxObservations = 8;

struct Field {
  std::int64_t time_ns = 0;  ///< of capture, or else of arrival; CLOCK_MONOTONIC of the daemon's host
  bool valid = false;        ///< false: nothing is known of this frame
  bool doubted = false;      ///< true: a flag says that errors may exceed what the deviations say
  Basis basis;
  std::vector<Observation> contacts;  ///< strongest first
};

}  // namespace touch

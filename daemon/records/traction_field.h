// What the solver says of one frame: the message that is published.
#pragma once

#include "daemon/records/marker_field.h"

namespace tractiond {

/// Covariance of force and moment (Fx, Fy, Fz, Mx, My, Mz), row after row [N^2, N^2 m, N^2 m^2].
using WrenchCovariance = std::array<double, 36>;

/// Where something touches, and how well that is known (standard deviations, of the noise alone).
struct Contact {
  std::array<double, 2> position_m{};  ///< of its normal forces; of all its forces where it does not press
  std::array<double, 2> positionDeviation_m{};
  std::array<double, 3> force_N{};
  std::array<double, 3> forceDeviation_N{};
  double area_m2 = 0.0;  ///< of an even pressure that would be as concentrated
  double areaDeviation_m2 = 0.0;
};
inline constexpr int kMaxContacts = 8;

/// How the forces were found.
enum class Method : std::uint8_t {
  kNone,       ///< not valid
  kNoContact,  ///< nothing above the detection limit: all forces are 0
  kContact,    ///< for the nodes alone that carry something
  kWholeFace,  ///< for all nodes, because the contact is large or does not explain the picture
  kBlend,      ///< a mean of the two, on the way from one to the other
};

/// Forces of the object on the gel, gel frame (x right, y up in the picture, z into the gel), SI. Sized once, reused.
struct TractionField {
  MarkerField markers;             ///< a copy of what the numbers were solved from
  std::vector<float> force_N;      ///< 3 N, node after node (x, y, z)
  std::vector<float> deviation_N;  ///< 3 N, standard deviation of each, of the noise alone; 0: nothing touches
  bool valid = false;              ///< false: too few markers, a wrong gel file or a numeric failure; all are 0
  Method method = Method::kNone;
  std::array<double, 3> resultant_N{};         ///< sum of the node forces
  std::array<double, 3> moment_Nm{};           ///< about the origin
  WrenchCovariance noise{};                    ///< of the two above: what differs from frame to frame
  WrenchCovariance systematic{};               ///< what does not: the sensor's numbers, the rim
  std::array<double, 2> centreOfPressure_m{};  ///< of the normal forces
  bool centreOfPressureValid = false;          ///< false where the normal force is too small for a centre
  double residual_px = 0.0;                    ///< root mean square over the valid markers' coordinates
  double strength = 0.0;                       ///< lambda of the regularisation that was used [px/N]
  std::array<double, 4> pictureMotion{};       ///< of the picture since the zero: u, v [px], scale [1], roll [rad]
  std::array<Contact, kMaxContacts> contacts{};
  int contactCount = 0;
  std::uint32_t flags = 0;

  void resize(int markerCount, int nodeCount);
};

}  // namespace tractiond

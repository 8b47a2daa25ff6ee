// Written with r = |offset|, s = r + z and kappa = 1 - 2 nu, the displacement for a force along axis j is
//
//   u_i = 1 / (4 pi G) [ x_i x_j / r^3 + delta_ij / r + kappa D_i d_i(phi_j) ],   D = diag(1, 1, -1),
//   phi_1 = x / s,  phi_2 = y / s,  phi_3 = -log(s),  all three harmonic.
//
// From this form the stress follows with the divergence, -2 kappa x_j / (4 pi G r^3), taken in closed form: no term
// grows as nu approaches 1/2, where Hooke's law on a numeric gradient would lose all its digits:
//
//   sigma_ik = 1 / (2 pi) [ -3 x_i x_k x_j / r^5 + kappa (x_j / r^3 delta_ik + d_i d_k(phi_j)) ]
//
// where the bracket after kappa is left out if i or k is 3 (it cancels there).
#include "sensor/elastic/half_space.h"

#include <cmath>
#include <numbers>

namespace sensor::elastic {

Eigen::Matrix3d halfSpaceDisplacement(const Eigen::Vector3d& offset, double youngsModulus, double poissonRatio) {
  const double x = offset.x(), y = offset.y(), z = offset.z();
  const double r = offset.norm();
  const double s = r + z;
  const double kappa = 1.0 - 2.0 * poissonRatio;
  const double inverse = 1.0 / r;
  const double inverseSquare = inverse * inverse;
  const double scale = (1.0 + poissonRatio) / (2.0 * std::numbers::pi * youngsModulus) * inverse;  // 1 / (4 pi G r)
  const double lean = kappa / s;  // times x: part of u_z under a tangential force
  const double shear = kappa / (s * s);
  Eigen::Matrix3d u;
  u(0, 0) = 1.0 + x * x * inverseSquare + kappa * r / s - x * x * shear;
  u(1, 1) = 1.0 + y * y * inverseSquare + kappa * r / s - y * y * shear;
  u(0, 1) = u(1, 0) = x * y * (inverseSquare - shear);
  u(2, 0) = x * (z * inverseSquare + lean);
  u(2, 1) = y * (z * inverseSquare + lean);
  u(0, 2) = x * (z * inverseSquare - lean);
  u(1, 2) = y * (z * inverseSquare - lean);
  u(2, 2) = z * z * inverseSquare + 1.0 + kappa;
  return scale * u;
}

std::array<Eigen::Matrix3d, 3> halfSpaceStress(const Eigen::Vector3d& offset, double poissonRatio) {
  const double x = offset.x(), y = offset.y(), z = offset.z();
  const double r = offset.norm();
  const double s = r + z;
  const double kappa = 1.0 - 2.0 * poissonRatio;
  const double scale = 1.0 / (2.0 * std::numbers::pi);
  const double inverseCube = 1.0 / (r * r * r);
  const double radial = -3.0 * inverseCube / (r * r);
  // Derivatives of g = 1 / s: g_i = -x_i first, g_ik = x_i x_k second - delta_ik first.
  const double first = 1.0 / (r * s * s);
  const double second = (3.0 * r + z) * inverseCube / (s * s * s);
  // Derivatives of log(s): delta_ik logFirst - x_i x_k logSecond.
  const double logFirst = 1.0 / (r * s);
  const double logSecond = (2.0 * r + z) * inverseCube / (s * s);

  std::array<Eigen::Matrix3d, 3> stress;
  const double in[3] = {x, y, z};
  for (int j = 0; j < 3; ++j) {
    Eigen::Matrix3d& sigma = stress[j];
    sigma.noalias() = (scale * radial * in[j]) * offset * offset.transpose();
    const double pressure = in[j] * inverseCube;
    double xx = 0.0, yy = 0.0, xy = 0.0;
    if (j == 2) {
      xx = x * x * logSecond - logFirst;
      yy = y * y * logSecond - logFirst;
      xy = x * y * logSecond;
    } else {
      xx = in[j] * (x * x * second - first) - (j == 0 ? 2.0 * x * first : 0.0);
      yy = in[j] * (y * y * second - first) - (j == 1 ? 2.0 * y * first : 0.0);
      xy = in[j] * x * y * second - (j == 0 ? y : x) * first;
    }
    sigma(0, 0) += scale * kappa * (pressure + xx);
    sigma(1, 1) += scale * kappa * (pressure + yy);
    sigma(0, 1) += scale * kappa * xy;
    sigma(1, 0) = sigma(0, 1);
  }
  return stress;
}

}  // namespace sensor::elastic

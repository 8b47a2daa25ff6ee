// Random loads on small sensors, and markers that go missing.
#pragma once

#include "tests/unit/solve/sensors.h"

#include <random>

namespace tractiond::solve {

inline double number(std::mt19937& random) {
  return std::normal_distribution<double>()(random);
}

/// Returns displacements under random forces at every fifth node component, with tracking noise.
inline MarkerField loaded(const Eigen::MatrixXd& influence, std::mt19937& random) {
  Eigen::VectorXd forces = Eigen::VectorXd::Zero(influence.cols());
  for (Eigen::Index i = 0; i < forces.size(); i += 5) forces[i] = number(random);
  Eigen::VectorXd displacement = influence * forces;
  for (double& d : displacement) d += 0.02 * number(random);
  return fieldOf(displacement);
}

inline void loseAtRandom(MarkerField& field, int count, std::mt19937& random) {
  std::uniform_int_distribution<std::size_t> marker(0, field.valid.size() - 1);
  while (count > 0) {
    const auto candidate = static_cast<int>(marker(random));
    count -= field.valid[candidate];
    loseMarker(field, candidate);
  }
}

}  // namespace tractiond::solve

// Estimates Young's modulus from known weights.
#pragma once

#include <string>
#include <vector>

namespace tractiond::calibrate {

inline constexpr double kGramForce = 9.80665e-3;  ///< [N]

/// A known weight, and the force that is read with the assumed Young's modulus.
struct WeighedForce {
  double weight_N = 0.0;
  double read_N = 0.0;
  double deviation_N = 0.0;  ///< of the reading, by noise
};

struct Stiffness {
  double youngsModulus = 0.0;  ///< [Pa]
  double deviation = 0.0;      ///< of the modulus, relative
  double linearity = 0.0;      ///< largest deviation of a reading from proportionality, relative
  std::vector<double> ofEach;  ///< Young's modulus by each weight alone [Pa]
  std::string contradiction;   ///< sentence for the operator; empty: the weights agree
};

/// Estimates E. The force that is read is proportional to the assumed modulus, so each weight gives E = assumed *
/// weight / reading; the result is the weighted mean of the logarithms. The weights may come in any order;
/// `contradiction` names weights that contradict each other. It also names a weight whose reading is not above 0;
/// modulus, deviation and linearity are then 0, and ofEach ends before that weight. Reentrant.
/// \param weights at least one (asserted), each above 0
/// \param assumed Young's modulus of the readings [Pa]
/// \param model relative deviation by which the mechanics err otherwise in each place
Stiffness fitStiffness(const std::vector<WeighedForce>& weights, double assumed, double model = 0.0);

}  // namespace tractiond::calibrate

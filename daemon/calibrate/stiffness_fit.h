// Estimates Young's modulus from known weights.
#pragma once

#include <string>
#include <vector>

namespace tractiond::calibrate {

inline constexpr double kGramForce = 9.80665e-3;  ///< [N]

struct StiffnessOptions {
  double weight = 1e-3;   ///< deviation of a weight, relative: class M3 has half of that
  double reading = 2e-3;  ///< of a reading, relative, in addition to its noise: contacts are not exactly round
  double contradiction =
      0.1;  ///< largest relative deviation from proportionality; beyond it weights are wrong or the gel is not linear
};

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

/// Estimates E. The force that is read is proportional to the assumed modulus, so each weight gives
/// E = assumed * weight / reading; the result is the weighted mean of the logarithms. The weights may come in any
/// order; `contradiction` names weights that contradict each other or fit only if they were exchanged. It also names a
/// weight whose reading is not above 0; modulus, deviation and linearity are then 0, and ofEach ends before that
/// weight. Reentrant. \param weights at least one (asserted), each above 0 \param assumed Young's modulus of the
/// readings [Pa]
Stiffness fitStiffness(const std::vector<WeighedForce>& weights, double assumed, const StiffnessOptions& options = {});

}  // namespace tractiond::calibrate

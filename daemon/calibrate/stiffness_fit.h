// Young's modulus from known weights.
#pragma once

#include <string>
#include <vector>

namespace tractiond::calibrate {

inline constexpr double kGramForce = 9.80665e-3;  ///< [N]

struct StiffnessOptions {
  double weight = 1e-3;        ///< deviation of a weight, relative: class M3 has half of that
  double reading = 2e-3;       ///< of a reading beside its noise: the contact is not quite round
  double contradiction = 0.1;  ///< weights that differ by more from proportion are wrong, or the gel is far from linear
};

/// A known weight, and what it reads with the Young's modulus assumed.
struct WeighedForce {
  double weight_N = 0.0;
  double read_N = 0.0;
  double deviation_N = 0.0;  ///< of the reading, by noise
};

struct Stiffness {
  double youngsModulus = 0.0;  ///< [Pa]
  double deviation = 0.0;      ///< of it, relative
  double linearity = 0.0;      ///< largest deviation of a reading from proportion, relative
  std::vector<double> ofEach;  ///< Young's modulus by each weight alone [Pa]
  std::string contradiction;   ///< empty: the weights agree; else a sentence for people
};

/// The force that is read is proportional to the modulus assumed, so E = assumed * weight / reading: a weighted mean of
/// its logarithm over the weights. The weights may stand in any order; those whose readings only fit another order are
/// called by name.
Stiffness fitStiffness(const std::vector<WeighedForce>& weights, double assumed, const StiffnessOptions& options = {});

}  // namespace tractiond::calibrate

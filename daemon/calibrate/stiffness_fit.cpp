#include "daemon/calibrate/stiffness_fit.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace tractiond::calibrate {

namespace {

// Relative deviations of a weight (class M3 has half of that), and of a reading in addition to its noise, as contacts
// are not exactly round.
constexpr double kWeight = 1e-3, kReading = 2e-3;
// Largest relative deviation from proportionality; beyond it weights are wrong or the gel is not linear.
constexpr double kContradiction = 0.1;

std::string grams(double newtons) {
  return fmt::format("{:.4g} gf", newtons / kGramForce);
}

struct Mean {
  double logarithm = 0.0;  ///< mean logarithm of E / assumed E
  double deviation = 0.0;
  double farthest = 0.0;  ///< largest deviation of a reading from proportionality
};

Mean meanOf(const std::vector<WeighedForce>& weights, double model) {
  double sum = 0.0, total = 0.0;
  std::vector<double> logarithms, shares;
  for (const WeighedForce& one : weights) {
    const double relative = std::hypot(one.deviation_N / one.read_N, kWeight, std::hypot(kReading, model));
    logarithms.push_back(std::log(one.weight_N / one.read_N));
    shares.push_back(1.0 / (relative * relative));
    sum += shares.back() * logarithms.back();
    total += shares.back();
  }
  Mean mean{sum / total, std::sqrt(1.0 / total), 0.0};
  double chi2 = 0.0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const double off = logarithms[i] - mean.logarithm;
    chi2 += shares[i] * off * off;
    mean.farthest = std::max(mean.farthest, std::abs(std::expm1(off)));
  }
  if (weights.size() > 1) mean.deviation *= std::max(1.0, std::sqrt(chi2 / static_cast<double>(weights.size() - 1)));
  return mean;
}

/// Returns a sentence about weights that do not agree.
std::string complaint(const std::vector<WeighedForce>& weights, double assumedOver) {
  std::string text = "the weights contradict each other:";
  for (const WeighedForce& one : weights) {
    text += (text.back() == ':' ? " " : ", ") + grams(one.weight_N) + " reads as " + grams(one.read_N * assumedOver);
  }
  return text;
}

}  // namespace

Stiffness fitStiffness(const std::vector<WeighedForce>& weights, double assumed, double model) {
  assert(!weights.empty());
  Stiffness stiffness;
  for (const WeighedForce& one : weights) {
    if (one.read_N <= 0.0) {
      stiffness.contradiction = grams(one.weight_N) + " does not press: it reads as " + grams(one.read_N);
      return stiffness;
    }
    stiffness.ofEach.push_back(assumed * one.weight_N / one.read_N);
  }
  const Mean mean = meanOf(weights, model);
  stiffness.youngsModulus = assumed * std::exp(mean.logarithm);
  stiffness.deviation = mean.deviation;
  stiffness.linearity = mean.farthest;
  if (mean.farthest > kContradiction) stiffness.contradiction = complaint(weights, std::exp(mean.logarithm));
  return stiffness;
}

}  // namespace tractiond::calibrate

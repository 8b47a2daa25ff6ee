#include "daemon/calibrate/stiffness_fit.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace tractiond::calibrate {

namespace {

std::string grams(double newtons) {
  return fmt::format("{:.4g} gf", newtons / kGramForce);
}

struct Mean {
  double logarithm = 0.0;  ///< mean logarithm of E / assumed E
  double deviation = 0.0;
  double farthest = 0.0;  ///< largest deviation of a reading from proportionality
};

Mean meanOf(const std::vector<WeighedForce>& weights, const StiffnessOptions& options) {
  double sum = 0.0, total = 0.0;
  std::vector<double> logarithms, shares;
  for (const WeighedForce& one : weights) {
    const double relative = std::hypot(one.deviation_N / one.read_N, options.weight, options.reading);
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
std::string complaint(const std::vector<WeighedForce>& weights, double assumedOver, const StiffnessOptions& options) {
  std::vector<double> known, read;
  for (const WeighedForce& one : weights) {
    known.push_back(one.weight_N);
    read.push_back(one.read_N);
  }
  std::ranges::sort(known);
  std::ranges::sort(read);
  std::vector<WeighedForce> sorted;
  for (std::size_t i = 0; i < known.size(); ++i) sorted.push_back({known[i], read[i], 0.0});
  const Mean inOrder = meanOf(sorted, options);
  const bool swapped = inOrder.farthest <= options.contradiction;
  std::string text = swapped ? "the weights were in the wrong order:" : "the weights contradict each other:";
  const double scale = swapped ? std::exp(inOrder.logarithm) : assumedOver;
  for (const WeighedForce& one : weights) {
    text += (text.back() == ':' ? " " : ", ") + grams(one.weight_N) + " reads as " + grams(one.read_N * scale);
  }
  return text;
}

}  // namespace

Stiffness fitStiffness(const std::vector<WeighedForce>& weights, double assumed, const StiffnessOptions& options) {
  assert(!weights.empty());
  Stiffness stiffness;
  for (const WeighedForce& one : weights) {
    if (one.read_N <= 0.0) {
      stiffness.contradiction = grams(one.weight_N) + " does not press: it reads as " + grams(one.read_N);
      return stiffness;
    }
    stiffness.ofEach.push_back(assumed * one.weight_N / one.read_N);
  }
  const Mean mean = meanOf(weights, options);
  stiffness.youngsModulus = assumed * std::exp(mean.logarithm);
  stiffness.deviation = mean.deviation;
  stiffness.linearity = mean.farthest;
  if (mean.farthest > options.contradiction) {
    stiffness.contradiction = complaint(weights, std::exp(mean.logarithm), options);
  }
  return stiffness;
}

}  // namespace tractiond::calibrate

#include "daemon/solve/creep_memory.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace tractiond::solve {
namespace {

Eigen::MatrixXd rootOf(const Eigen::MatrixXd& covariance) {
  if (covariance.size() == 0) return covariance;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

}  // namespace

CreepMemory::CreepMemory(const std::vector<sensor::CreepTerm>& terms, int markers)
    : coordinates_(2 * static_cast<std::size_t>(markers))
    , root_(rootOf(sensor::creepCovariance(terms)))
    , elastic_(coordinates_) {
  for (const sensor::CreepTerm& term : terms) {
    terms_.push_back({.share = term.share, .time_s = term.time_s, .follows = std::vector<double>(coordinates_)});
  }
}

void CreepMemory::advance(MarkerField& markers) {
  if (terms_.empty()) return;
  const FrameTimes& times = markers.info.times;
  const std::int64_t now_ns = times.captured_ns != 0 ? times.captured_ns : times.received_ns;
  if (!hasBegun_ || markers.zero != zero_) {
    std::ranges::fill(elastic_, 0.0);
    for (Term& term : terms_) std::ranges::fill(term.follows, 0.0);
    time_ns_ = now_ns;
  }
  hasBegun_ = true;
  zero_ = markers.zero;
  step(1e-9 * static_cast<double>(std::max<std::int64_t>(now_ns - time_ns_, 0)));
  time_ns_ = now_ns;
  takeOff(markers);
  findErrors(markers);
}

/// Sets how the terms follow over a step in which u is linear.
void CreepMemory::step(double seconds) {
  for (Term& term : terms_) {
    const double steps = seconds / term.time_s;
    term.left = std::exp(-steps);
    const double mean = steps > 0.0 ? -std::expm1(-steps) / steps : 1.0;  // of the decay over the step
    term.before = mean - term.left;
    term.now = 1.0 - mean;
  }
}

void CreepMemory::takeOff(MarkerField& markers) {
  markers.elastic_px.resize(coordinates_);
  double own = 1.0;  // of the new u in d
  for (const Term& term : terms_) own += term.share * term.now;
  for (std::size_t i = 0; i < coordinates_; ++i) {
    const double before = elastic_[i];
    const bool isValid = markers.valid[i / 2] != 0;
    if (isValid) {
      double displacement = markers.displacement_px[i];
      for (const Term& term : terms_) displacement -= term.share * (term.left * term.follows[i] + term.before * before);
      elastic_[i] = displacement / own;
    }
    for (Term& term : terms_)
      term.follows[i] = term.left * term.follows[i] + term.before * before + term.now * elastic_[i];
    markers.elastic_px[i] = isValid ? static_cast<float>(elastic_[i]) : 0.0F;
  }
}

void CreepMemory::findErrors(MarkerField& markers) const {
  markers.creepErrors_px.resize(terms_.size() * coordinates_);
  double squares = 0.0;
  auto error = markers.creepErrors_px.begin();
  for (Eigen::Index column = 0; column < root_.cols(); ++column) {
    for (std::size_t i = 0; i < coordinates_; ++i, ++error) {
      double sum = 0.0;
      for (std::size_t k = 0; k < terms_.size(); ++k)
        sum += root_(static_cast<Eigen::Index>(k), column) * terms_[k].follows[i];
      *error = markers.valid[i / 2] != 0 ? static_cast<float>(sum) : 0.0F;
      squares += double{*error} * double{*error};
    }
  }
  markers.creepError_px = static_cast<float>(std::sqrt(squares));
}

}  // namespace tractiond::solve

#include "daemon/track/creep_memory.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace tractiond::track {
namespace {

Eigen::MatrixXd rootOf(const Eigen::MatrixXd& covariance) {
  if (covariance.size() == 0) return covariance;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

Eigen::VectorXd each(const std::vector<sensor::CreepTerm>& terms, double sensor::CreepTerm::*number) {
  Eigen::VectorXd numbers(std::ssize(terms));
  std::ranges::transform(terms, numbers.begin(), number);
  return numbers;
}

}  // namespace

CreepMemory::CreepMemory(const std::vector<sensor::CreepTerm>& terms, int markers)
    : shares_(each(terms, &sensor::CreepTerm::share))
    , times_s_(each(terms, &sensor::CreepTerm::time_s))
    , root_(rootOf(sensor::creepCovariance(terms)))
    , elastic_(2 * markers)
    , next_(2 * markers)
    , follows_(2 * markers, shares_.size()) {}

void CreepMemory::advance(MarkerField& markers) {
  const Eigen::Index coordinates = elastic_.size(), terms = shares_.size();
  if (terms == 0) return;
  const FrameTimes& times = markers.info.times;
  const std::int64_t now_ns = times.captured_ns != 0 ? times.captured_ns : times.received_ns;
  if (zero_ != markers.zero) {
    elastic_.setZero();
    follows_.setZero();
    time_ns_ = now_ns;
  }
  zero_ = markers.zero;
  const double seconds = 1e-9 * static_cast<double>(std::max<std::int64_t>(now_ns - time_ns_, 0));
  time_ns_ = now_ns;

  // What follows of earlier frames, and how much of this one will: u is linear over the step.
  double own = 1.0;  // of the new u in d
  for (Eigen::Index k = 0; k < terms; ++k) {
    const double steps = seconds / times_s_[k], left = std::exp(-steps);
    const double mean = steps > 0.0 ? -std::expm1(-steps) / steps : 1.0;  // of the decay over the step
    follows_.col(k) = left * follows_.col(k) + (mean - left) * elastic_;
    own += shares_[k] * (1.0 - mean);
  }
  next_ = Eigen::Map<const Eigen::VectorXf>(markers.displacement_px.data(), coordinates).cast<double>();
  for (Eigen::Index k = 0; k < terms; ++k) next_ -= shares_[k] * follows_.col(k);
  next_ /= own;
  const auto eachMissing = [&](auto use) {
    for (std::size_t marker = 0; marker < markers.valid.size(); ++marker) {
      if (markers.valid[marker] == 0) use(2 * static_cast<Eigen::Index>(marker));
    }
  };
  eachMissing([&](Eigen::Index at) { next_.segment<2>(at) = elastic_.segment<2>(at); });
  elastic_.swap(next_);
  for (Eigen::Index k = 0; k < terms; ++k) {
    const double steps = seconds / times_s_[k];
    if (steps > 0.0) follows_.col(k) += (1.0 + std::expm1(-steps) / steps) * elastic_;
  }

  markers.elastic_px.resize(static_cast<std::size_t>(coordinates));
  markers.creepErrors_px.resize(static_cast<std::size_t>(coordinates * terms));
  Eigen::Map<Eigen::VectorXf> elastic(markers.elastic_px.data(), coordinates);
  Eigen::Map<Eigen::MatrixXf> errors(markers.creepErrors_px.data(), coordinates, terms);
  elastic = elastic_.cast<float>();
  errors = follows_.lazyProduct(root_).cast<float>();
  eachMissing([&](Eigen::Index at) {
    elastic.segment<2>(at).setZero();
    errors.middleRows<2>(at).setZero();
  });
  markers.creepError_px = errors.norm();
}

void CreepMemory::resume(const Id& zero, std::int64_t time_ns, const Eigen::VectorXd& elastic_px,
                         const Eigen::MatrixXd& follows_px) {
  zero_ = zero;
  time_ns_ = time_ns;
  elastic_ = elastic_px;
  follows_ = follows_px;
}

}  // namespace tractiond::track

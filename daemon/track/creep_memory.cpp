#include "daemon/track/creep_memory.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <utility>

namespace tractiond::track {
namespace {

/// Of the times of creep, after which what was remembered has faded.
constexpr double kForgotten = 3.0;

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

CreepStep::CreepStep(double seconds, double time_s) {
  const double steps = seconds / time_s;
  left = std::exp(-steps);
  const double mean = steps > 0.0 ? -std::expm1(-steps) / steps : 1.0;  // of the decay over the step
  before = mean - left;
  now = 1.0 - mean;
}

CreepMemory::CreepMemory(const std::vector<sensor::CreepTerm>& terms, int markers)
    : shares_(each(terms, &sensor::CreepTerm::share))
    , times_s_(each(terms, &sensor::CreepTerm::time_s))
    , root_(rootOf(sensor::creepCovariance(terms)))
    , elastic_(2 * markers)
    , next_(2 * markers)
    , follows_(2 * markers, shares_.size())
    , followed_(2 * markers) {}

void CreepMemory::advance(MarkerField& markers) {
  const Eigen::Index coordinates = elastic_.size(), terms = shares_.size();
  if (terms == 0) return;
  const std::int64_t now_ns = momentOf(markers.info.times);
  if (zero_ != markers.zero) {
    elastic_.setZero();
    follows_.setZero();
    time_ns_ = now_ns;
    const double doubted_s = std::exchange(isDoubted_, false) ? kForgotten * times_s_.maxCoeff() : 0.0;
    doubtedUntil_ns_ = now_ns + static_cast<std::int64_t>(1e9 * doubted_s);
  }
  if (now_ns < doubtedUntil_ns_) markers.flags |= kRecovering;
  zero_ = markers.zero;
  const double seconds = 1e-9 * static_cast<double>(std::max<std::int64_t>(now_ns - time_ns_, 0));
  time_ns_ = now_ns;

  // What follows of earlier frames, and how much of this one will.
  double own = 1.0;  // of the new u in d
  next_ = Eigen::Map<const Eigen::VectorXf>(markers.displacement_px.data(), coordinates).cast<double>();
  if (!markers.drift_px.empty()) {
    next_ -= Eigen::Map<const Eigen::VectorXf>(markers.drift_px.data(), coordinates).cast<double>();
  }
  for (Eigen::Index k = 0; k < terms; ++k) {
    const CreepStep step(seconds, times_s_[k]);
    follows_.col(k) = step.left * follows_.col(k) + step.before * elastic_;
    next_ -= shares_[k] * follows_.col(k);
    own += shares_[k] * step.now;
  }
  next_ /= own;
  const auto eachMissing = [&](auto use) {
    for (std::size_t marker = 0; marker < markers.valid.size(); ++marker) {
      if (markers.valid[marker] == 0) use(2 * static_cast<Eigen::Index>(marker));
    }
  };
  eachMissing([&](Eigen::Index at) { next_.segment<2>(at) = elastic_.segment<2>(at); });
  elastic_.swap(next_);

  markers.elastic_px.resize(static_cast<std::size_t>(coordinates));
  markers.creepErrors_px.resize(static_cast<std::size_t>(coordinates * terms));
  Eigen::Map<Eigen::VectorXf> elastic(markers.elastic_px.data(), coordinates);
  Eigen::Map<Eigen::MatrixXf> errors(markers.creepErrors_px.data(), coordinates, terms);
  elastic = elastic_.cast<float>();
  errors.setZero();
  for (Eigen::Index k = 0; k < terms; ++k) {  // whole columns: a product of matrices this narrow takes a fifth longer
    follows_.col(k) += CreepStep(seconds, times_s_[k]).now * elastic_;
    followed_ = follows_.col(k).cast<float>();
    for (Eigen::Index j = 0; j < terms; ++j) errors.col(j) += static_cast<float>(root_(k, j)) * followed_;
  }
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

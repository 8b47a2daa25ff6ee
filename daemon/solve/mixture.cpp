#include "daemon/solve/mixture.h"

#include "daemon/solve/kernels.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace tractiond::solve {
namespace {

/// A candidate that is less likely than the likeliest one by this factor is left out: even far from the others it does
/// not show.
constexpr double kNothing = 1e-9;

/// A candidate with a smaller share adds nothing to the nodes' variances but its distance from the mean.
constexpr double kLittle = 1e-3;

}  // namespace

Mixture::Mixture(const Atoms& atoms, int most)
    : atoms_(atoms)
    , parts_(most)
    , mean_(3 * (atoms.pointCount() + kCouples))
    , away_(mean_.size())
    , deviation_(3 * atoms.nodeCount())
    , nodeAway_(deviation_.size()) {
  for (Part& part : parts_) part.force_N.resize(mean_.size());
}

void Mixture::clear() {
  count_ = 0;
  std::fill(mean_.begin(), mean_.end(), 0.0);
}

std::span<double> Mixture::add(Candidate& candidate, Kind kind, double worth, const Wrench& wrench) {
  assert(count_ < static_cast<int>(parts_.size()));
  Part& part = parts_[count_++];
  part.candidate = &candidate;
  part.kind = kind;
  part.worth = worth;
  part.wrench = wrench;
  return part.force_N;
}

template <typename Use>
void Mixture::eachThatCounts(Use use) {
  for (Part& part : std::span(parts_).first(count_)) {
    if (part.share > 0.0) use(part);
  }
}

double Mixture::mostWorth() const {
  const auto isLess = [](const Part& a, const Part& b) { return a.worth < b.worth; };
  return std::max_element(parts().begin(), parts().end(), isLess)->worth;
}

void Mixture::weigh() {
  const auto parts = std::span(parts_).first(count_);
  const double most = mostWorth();
  double sum = 0.0;
  for (Part& part : parts) {
    const double ratio = std::exp(part.worth - most);
    sum += part.share = ratio > kNothing ? ratio : 0.0;
  }
  for (Part& part : parts) part.share /= sum;
  std::fill(mean_.begin(), mean_.end(), 0.0);
  eachThatCounts([this](const Part& part) {
    for (std::size_t i = 0; i < mean_.size(); ++i) mean_[i] += part.share * part.force_N[i];
  });
}

double Mixture::shareOf(Kind kind) const {
  double sum = 0.0;
  for (const Part& part : parts()) sum += part.kind == kind ? part.share : 0.0;
  return sum;
}

Wrench Mixture::wrench() const {
  Wrench mean = Wrench::Zero();
  for (const Part& part : parts()) mean += part.share * part.wrench;
  return mean;
}

std::array<double, kMotions> Mixture::motion() const {
  std::array<double, kMotions> mean{};
  for (const Part& part : parts()) {
    for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += part.share * part.candidate->motion()[i];
  }
  return mean;
}

double Mixture::squaredResidual_px2() const {
  double mean = 0.0;
  for (const Part& part : parts()) mean += part.share * part.candidate->squaredResidual_px2();
  return mean;
}

void Mixture::wrenchCovariance(std::array<double, 36>& covariance) {
  covariance.fill(0.0);
  const Wrench mean = wrench();
  eachThatCounts([&](Part& part) {
    std::array<double, 36> within{};
    part.candidate->wrenchCovariance(within);
    const Wrench away = part.wrench - mean;
    Matrix6::Map(covariance.data()) += part.share * (Matrix6::Map(within.data()) + away * away.transpose());
  });
}

void Mixture::nodeDeviations_N(std::span<double> deviations) {
  std::fill(deviations.begin(), deviations.end(), 0.0);
  eachThatCounts([&](Part& part) {
    if (part.share > kLittle) {
      part.candidate->nodeDeviations_N(deviation_);
    } else {
      std::fill(deviation_.begin(), deviation_.end(), 0.0);
    }
    for (std::size_t i = 0; i < away_.size(); ++i) away_[i] = part.force_N[i] - mean_[i];
    addAtNodes(atoms_, away_, nodeAway_);
    for (std::size_t i = 0; i < deviations.size(); ++i) {
      deviations[i] += part.share * (square(deviation_[i]) + square(nodeAway_[i]));
    }
  });
  for (double& each : deviations) each = std::sqrt(each);
}

void Mixture::covariance(std::span<const double> weights, std::span<const int> points, std::span<double> covariance) {
  constexpr std::array<int, 1> kFirst = {0};
  std::fill(covariance.begin(), covariance.end(), 0.0);
  eachThatCounts([&](Part& part) {
    std::array<double, std::size_t{kColumns} * kColumns> within{};
    std::array<double, kColumns> away{};
    part.candidate->covariance(weights, points, within);
    for (const int point : points) {
      const auto first = 3 * point;
      std::array<double, 3> deviation;
      for (std::size_t axis = 0; axis < 3; ++axis) deviation[axis] = part.force_N[first + axis] - mean_[first + axis];
      addForces(kFirst, deviation.data(), weights.data() + kColumns * first, away.data());
    }
    for (std::size_t i = 0; i < kColumns; ++i) {
      for (std::size_t j = 0; j < kColumns; ++j) {
        covariance[kColumns * i + j] += part.share * (within[kColumns * i + j] + away[i] * away[j]);
      }
    }
  });
}

void Mixture::leastVariances(std::span<const double> weights, std::span<const int> points,
                             std::span<double> variances) {
  const auto isLess = [](const Part& a, const Part& b) { return a.share < b.share; };
  const Part& likeliest = *std::max_element(parts().begin(), parts().end(), isLess);
  likeliest.candidate->leastVariances(weights, points, variances);
  for (double& each : variances) each *= likeliest.share;
}

}  // namespace tractiond::solve

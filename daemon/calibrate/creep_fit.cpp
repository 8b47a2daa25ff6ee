#include "daemon/calibrate/creep_fit.h"

#include "daemon/track/creep_memory.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cmath>

namespace tractiond::calibrate {
namespace {

/// Times of the terms, as parts of the time for which the load stays. They are so close that two terms of any times
/// between them are followed to 0.3 % of the load in the worst case, 0.07 % in the mean. What is faster cannot be
/// distinguished from how a weight comes to rest; the last one stands for what a longer load would show.
constexpr std::array kTimes = {1.0 / 60, 1.0 / 15, 1.0 / 4, 2.0, 20.0};
constexpr int kTerms = kTimes.size();
constexpr double kPrior = 0.05;  // deviation of each share before anything is measured
constexpr double kLeastError =
    5e-4;                       // lower bound of CreepFit::error: of the pictures' drift, which the rest may not show
constexpr double kStep = 0.01;  // change from reading to reading by which the load is still on its way
constexpr double kOnTheWay_s = 3.0;  // longest time for that
constexpr int kRounds = 3;           // the load on its way is a share of what it displaces at once

using Terms = Eigen::Matrix<double, kTerms, 1>;
using Square = Eigen::Matrix<double, kTerms, kTerms>;
/// The amount that the load displaces at once, and those of the terms.
using Unknowns = Eigen::Matrix<double, kTerms + 1, 1>;
using Normal = Eigen::Matrix<double, kTerms + 1, kTerms + 1>;

/// A reading at which the load is known.
struct Loaded {
  LoadReading reading;
  double load = 0.0;  ///< as a share of that which stays
  bool isSettled = false;
};

/// Returns the readings with those marked at which the load is at rest; nothing if it is too long on its way.
std::optional<std::vector<Loaded>> settled(const std::vector<LoadReading>& readings) {
  std::vector<Loaded> all;
  for (const LoadReading& each : readings)
    all.push_back({.reading = each, .load = each.phase == LoadPhase::kLoaded ? 1.0 : 0.0, .isSettled = true});
  const auto moves = [&](std::size_t i) { return std::abs(readings[i].amount - readings[i - 1].amount) > kStep; };
  for (std::size_t turn = 1; turn < readings.size(); ++turn) {
    if (readings[turn].phase == readings[turn - 1].phase) continue;
    const auto isNear = [&](std::size_t i) { return std::abs(readings[i].at_s - readings[turn].at_s) <= kOnTheWay_s; };
    std::size_t first = turn, last = turn;  // on the way, which may have begun before it was noticed
    for (std::size_t i = turn; i > 0 && isNear(i); --i) {
      if (moves(i)) first = i;
    }
    for (std::size_t i = turn; i < readings.size() && isNear(i); ++i) {
      if (moves(i)) last = i;
    }
    for (std::size_t i = first; i <= last; ++i) all[i].isSettled = false;
  }
  for (std::size_t i = 1; i < readings.size(); ++i) {
    if (moves(i) && all[i].isSettled) return std::nullopt;
  }
  return all;
}

/// Returns how the terms follow a load that changes linearly in a step.
Terms followed(const Terms& follows, const Terms& times_s, const Loaded& before, const Loaded& now) {
  Terms next;
  for (int k = 0; k < kTerms; ++k) {
    const track::CreepStep step(now.reading.at_s - before.reading.at_s, times_s[k]);
    next[k] = step.left * follows[k] + step.before * before.load + step.now * now.load;
  }
  return next;
}

/// Solves for the unknowns, of which none is negative: the one that would be most so is 0, until none would be.
Unknowns withoutNegative(Normal normal, Unknowns right) {
  for (;;) {
    const Unknowns found = normal.llt().solve(right);
    Eigen::Index least = 0;
    if (found.minCoeff(&least) >= 0.0) return found;
    normal.row(least).setZero();
    normal.col(least).setZero();
    normal(least, least) = 1.0;
    right[least] = 0.0;
  }
}

std::vector<sensor::CreepTerm> termsOf(const Terms& shares, const Square& covariance, const Terms& times_s) {
  std::vector<sensor::CreepTerm> terms;
  const Terms deviations = covariance.diagonal().cwiseSqrt();
  for (int k = 0; k < kTerms; ++k) {
    terms.push_back({.share = shares[k], .time_s = times_s[k], .deviation = deviations[k], .correlation = {}});
    for (int j = 0; j < k; ++j) {
      terms.back().correlation.push_back(covariance(k, j) / (deviations[k] * deviations[j]));
    }
  }
  return terms;
}

}  // namespace

std::optional<CreepFit> fitCreep(const std::vector<LoadReading>& readings, double held_s) {
  auto all = settled(readings);
  if (!all) return std::nullopt;
  const auto staying = std::ranges::find_if(
      *all, [](const Loaded& each) { return each.isSettled && each.reading.phase == LoadPhase::kLoaded; });
  if (staying == all->end()) return std::nullopt;

  const Terms times_s = held_s * Eigen::Map<const Terms>(kTimes.data());
  CreepFit fit;
  fit.load = staying->reading.amount;
  fit.error = kLeastError;
  Terms shares, follows;
  Square covariance;
  for (int round = 0; round < kRounds; ++round) {
    for (Loaded& each : *all) {
      if (!each.isSettled) each.load = each.reading.amount / fit.load;
    }
    Normal normal = Normal::Zero();
    Unknowns right = Unknowns::Zero();
    double square = 0.0, seconds = 0.0;
    follows.setZero();
    // Each second counts as one reading, as errors of a drifting picture are not independent from frame to frame.
    for (std::size_t i = 1; i < all->size(); ++i) {
      const Loaded& each = (*all)[i];
      const auto& [at_s, length_s, amount, phase] = each.reading;
      follows = followed(follows, times_s, (*all)[i - 1], each);
      if (!each.isSettled) continue;
      const Unknowns row = (Unknowns() << each.load, follows).finished();
      normal += length_s * row * row.transpose();
      right += length_s * amount * row;
      square += length_s * amount * amount;
      seconds += length_s;
    }
    Normal posterior = normal;
    posterior.diagonal().tail<kTerms>().array() += std::pow(fit.error / kPrior, 2);
    const Unknowns found = withoutNegative(posterior, right);
    const double squares = std::max(square - 2.0 * found.dot(right) + found.dot(normal * found), 0.0);
    fit.load = found[0];
    fit.error = std::max(std::sqrt(squares / seconds) / fit.load, kLeastError);
    shares = found.tail<kTerms>() / fit.load;
    Eigen::Matrix<double, kTerms, kTerms + 1> byUnknowns;
    byUnknowns << -shares, Square::Identity();
    covariance = fit.error * fit.error * byUnknowns * posterior.llt().solve(byUnknowns.transpose());
  }
  fit.terms = termsOf(shares, covariance, times_s);
  fit.now = all->back().load;
  fit.follows = follows;
  return fit;
}

}  // namespace tractiond::calibrate

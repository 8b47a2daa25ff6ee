// Collects durations: quantiles of one reporting interval, and a histogram since the start.
#pragma once

#include "traction/v1/status.pb.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace tractiond::publish {

/// Keeps the newest 2,048 durations of an interval. Thread-bound. Allocates nothing.
class Durations {
 public:
  /// Adds a duration [ns]. Of more than 2,048 in an interval the newest count for the quantiles, all for the histogram.
  void add(std::int64_t ns) {
    values_[count_++ % values_.size()] = ns;
    const double value_s = static_cast<double>(ns) * 1e-9;
    const auto bound = std::lower_bound(kBounds_s.begin(), kBounds_s.end(), value_s);
    ++counts_[static_cast<std::size_t>(bound - kBounds_s.begin())];
    sum_s_ += value_s;
  }

  /// Sets the median, the 99 % quantile and the largest of the durations since the last call [s], 0 if there are none,
  /// and the histogram of all since the start. Begins a new interval. Allocates nothing after the first call with the
  /// same message.
  void take(traction::v1::Quantiles& to) {
    traction::v1::Histogram& all = *to.mutable_since_start();
    all.mutable_bound_s()->Assign(kBounds_s.begin(), kBounds_s.end());
    all.mutable_count()->Assign(counts_.begin(), counts_.end());
    all.set_sum_s(sum_s_);
    const auto end = values_.begin() + static_cast<std::ptrdiff_t>(std::min(count_, values_.size()));
    count_ = 0;
    const auto at = [&](double share) {
      if (end == values_.begin()) return 0.0;
      const auto nth = values_.begin() + std::lround(share * static_cast<double>(end - values_.begin() - 1));
      std::nth_element(values_.begin(), nth, end);
      return static_cast<double>(*nth) * 1e-9;
    };
    to.set_p50_s(at(0.5));
    to.set_p99_s(at(0.99));
    to.set_max_s(at(1.0));
  }

 private:
  static constexpr std::array kBounds_s = {1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0};

  std::array<std::int64_t, 2048> values_{};
  std::size_t count_ = 0;
  /// Above the bound before, at most their own; the last: above all.
  std::array<std::uint64_t, kBounds_s.size() + 1> counts_{};
  double sum_s_ = 0.0;
};

}  // namespace tractiond::publish

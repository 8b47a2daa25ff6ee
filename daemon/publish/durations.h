// Durations of one reporting interval with their quantiles, and all since the start.
#pragma once

#include "daemon/publish/status.h"

#include <algorithm>
#include <cmath>

namespace tractiond::publish {

/// Keeps the newest 2,048. Allocates nothing.
class Durations {
 public:
  void add(std::int64_t ns) {
    values_[count_++ % values_.size()] = ns;
    const double value_s = static_cast<double>(ns) * 1e-9;
    const auto bound = std::lower_bound(Histogram::kBounds_s.begin(), Histogram::kBounds_s.end(), value_s);
    ++all_.counts[static_cast<std::size_t>(bound - Histogram::kBounds_s.begin())];
    all_.sum_s += value_s;
  }

  /// Of what was added since the last call, quantiles; all 0 where that is nothing.
  Quantiles take() {
    const auto end = values_.begin() + static_cast<std::ptrdiff_t>(std::min(count_, values_.size()));
    count_ = 0;
    if (end == values_.begin()) return {0.0, 0.0, 0.0, all_};
    const auto last = end - values_.begin() - 1;
    const auto at = [&](double share) {
      const auto nth = values_.begin() + std::lround(share * static_cast<double>(last));
      std::nth_element(values_.begin(), nth, end);
      return static_cast<double>(*nth) * 1e-9;
    };
    return {at(0.5), at(0.99), at(1.0), all_};
  }

 private:
  std::array<std::int64_t, 2048> values_{};
  std::size_t count_ = 0;
  Histogram all_;
};

}  // namespace tractiond::publish

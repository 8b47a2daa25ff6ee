// Durations of one reporting interval, and their quantiles.
#pragma once

#include "daemon/publish/status.h"

#include <algorithm>
#include <cmath>

namespace tractiond::publish {

/// Keeps the newest 2,048. Allocates nothing.
class Durations {
 public:
  void add(std::int64_t ns) { values_[count_++ % values_.size()] = ns; }

  /// Of what was added since the last call; all 0 where that is nothing.
  Quantiles take() {
    const auto end = values_.begin() + static_cast<std::ptrdiff_t>(std::min(count_, values_.size()));
    count_ = 0;
    if (end == values_.begin()) return {};
    const auto last = end - values_.begin() - 1;
    const auto at = [&](double share) {
      const auto nth = values_.begin() + std::lround(share * static_cast<double>(last));
      std::nth_element(values_.begin(), nth, end);
      return static_cast<double>(*nth) * 1e-9;
    };
    return {at(0.5), at(0.99), at(1.0)};
  }

 private:
  std::array<std::int64_t, 2048> values_{};
  std::size_t count_ = 0;
};

}  // namespace tractiond::publish

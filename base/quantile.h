// The value below which a share of a range lies.
#pragma once

#include <algorithm>
#include <cstddef>
#include <ranges>

namespace tractiond {

/// Returns the value that this share of a range does not exceed, and reorders the range.
/// \param values at least one
/// \param share from 0 to below 1; 0.5: the median
template <std::ranges::random_access_range Values>
std::ranges::range_value_t<Values> quantile(Values&& values, double share = 0.5) {
  const auto size = static_cast<double>(std::ranges::size(values));
  const auto at = std::ranges::begin(values) + static_cast<std::ptrdiff_t>(share * size);
  std::ranges::nth_element(values, at);
  return *at;
}

}  // namespace tractiond

#include "daemon/solve/selection.h"

#include <algorithm>

namespace tractiond::solve {

void Chosen::reserve(int most) {
  const auto count = static_cast<std::size_t>(most);
  atoms.reserve(count);
  gamma_N2.reserve(count);
  covariance_N2.reserve(count);
}

Selection::Selection(const Factors& factors)
    : value_(factors.atomCount())
    , order_(every(factors.atomCount())) {
  for (int a = 0; a < factors.atomCount(); ++a) size_.push_back(factors.gramOf(a, a).trace() / 3.0);
}

void Selection::choose(std::span<const double> gamma_N2, int most, bool entering, double noise_px, Chosen& chosen) {
  for (std::size_t a = 0; a < value_.size(); ++a) value_[a] = gamma_N2[a] * size_[a];
  const auto count = std::min(static_cast<std::size_t>(most), order_.size());
  const auto sorted = order_.begin() + static_cast<std::ptrdiff_t>(std::min(count + 1, order_.size()));
  std::partial_sort(order_.begin(), sorted, order_.end(),
                    [this](int a, int b) { return value_[a] > value_[b] || (value_[a] == value_[b] && a < b); });
  const double next = entering && count < order_.size() ? value_[order_[count]] : 0.0;
  std::sort(order_.begin(), order_.begin() + static_cast<std::ptrdiff_t>(count));  // as the matrices are stored
  chosen.atoms.clear();
  chosen.gamma_N2.clear();
  for (std::size_t i = 0; i < count; ++i) {
    const double left = value_[order_[i]] - next;
    if (left <= ModelConstants::kFloor * square(noise_px)) continue;
    chosen.atoms.push_back(order_[i]);
    chosen.gamma_N2.push_back(left / size_[order_[i]]);
  }
}

}  // namespace tractiond::solve

// The usual time between two fields.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace touch {

/// The last intervals between fields, in any unit: a few that are long do not change their median.
class Intervals {
 public:
  void add(double interval) {
    if (last_.size() == kMost) last_.erase(last_.begin());
    last_.push_back(interval);
  }
  void clear() { last_.clear(); }
  /// Returns the median, of an even number the lower one; or `otherwise` if there is none.
  double median(double otherwise) const {
    if (last_.empty()) return otherwise;
    std::vector<double> sorted = last_;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>((sorted.size() - 1) / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    return *middle;
  }

 private:
  static constexpr std::size_t kMost = 8;
  std::vector<double> last_;
};

/// Number of intervals without a field after which something is missing.
inline constexpr double kPatientIntervals = 3.0;

}  // namespace touch

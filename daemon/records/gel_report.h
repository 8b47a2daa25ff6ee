// What the rest picture says of the gel file.
#pragma once

#include <string>
#include <vector>

namespace tractiond {

/// How many columns and rows of markers a layer shows, whatever its description says. Those that would lie outside the
/// picture count as there.
struct LatticeSeen {
  int columns = 0, rows = 0;
};

struct GelReport {
  /// A number of the gel file, and what the picture shows instead.
  struct Finding {
    std::string name;  ///< with its unit: "pitch_mm", "blue_columns"
    double expected = 0.0;
    double seen = 0.0;
    double deviation = 0.0;  ///< standard, of the difference; 0: a number that is counted
    bool contradicts = false;
  };
  std::vector<Finding> findings;
  std::string remark;  ///< for people: what does not fit, and what to do; empty: all fits

  bool fits() const { return remark.empty(); }
  /// Returns a sentence for people; empty: the gel file fits.
  std::string doubt() const;
};

}  // namespace tractiond

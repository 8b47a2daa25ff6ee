// Result of the comparison of a rest picture with the gel file.
#pragma once

#include <string>
#include <vector>

namespace tractiond {

/// Number of columns and rows of markers that a layer shows, independent of its description. Those that would lie
/// outside the picture count as seen.
struct LatticeSeen {
  int columns = 0, rows = 0;
};

struct GelReport {
  /// A number of the gel file, and its value in the picture.
  struct Finding {
    std::string name;  ///< with its unit: "pitch_mm", "blue_columns"
    double expected = 0.0;
    double seen = 0.0;
    double deviation = 0.0;    ///< standard deviation of the difference; 0: a number that is counted
    bool contradicts = false;  ///< the difference is too large for the deviation, or the counts differ
  };
  std::vector<Finding> findings;
  bool otherLook = false;  ///< the picture shows the file's gel turned, mirrored or with the layers' colours exchanged
  std::string remark;      ///< for the operator: what does not fit, and what to do; empty: everything fits

  bool fits() const { return remark.empty(); }  ///< Returns whether the gel file fits.
  /// Returns `remark` as a sentence without a full stop, which adds that no forces are valid; empty if the gel file
  /// fits.
  std::string doubt() const;
};

}  // namespace tractiond

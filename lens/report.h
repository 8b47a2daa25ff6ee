// What a command has found: for people as text, for programs as JSON.
#pragma once

#include "base/error.h"

#include <string>
#include <vector>

namespace lens {

/// All errors of a command, at least one; each is printed on one line.
using Faults = std::vector<tractiond::Error>;

/// Collects figures and remarks in the order in which a command adds them. Patterns are those of printf().
class Report {
 public:
  /// Adds a line that only people need, such as a heading.
  [[gnu::format(printf, 2, 3)]] void line(const char* pattern, ...);
  /// Adds a result; text shows it as a row of a table.
  /// \param deviation standard deviation; negative: none is known
  /// \param unit of both; may be empty
  void figure(const std::string& name, double value, double deviation, const char* unit);
  /// Adds a note that text shows as one of a list.
  [[gnu::format(printf, 2, 3)]] void item(const char* pattern, ...);
  /// Adds a remark on the results.
  [[gnu::format(printf, 2, 3)]] void note(const char* pattern, ...);
  /// Adds a remark that says why the results are worse than they look.
  [[gnu::format(printf, 2, 3)]] void warning(const char* pattern, ...);

  /// Returns all of it as lines.
  const std::string& text() const { return text_; }
  /// Returns {"figures": [{"name", "value", "deviation" unless negative, "unit"}], "notes": [text], "faults": [text]};
  /// warnings are notes that begin with "warning: ".
  std::string json(const Faults& faults) const;

 private:
  struct Figure {
    std::string name;
    double value, deviation;
    std::string unit;
  };
  std::string text_;
  std::vector<Figure> figures_;
  std::vector<std::string> notes_;
};

}  // namespace lens

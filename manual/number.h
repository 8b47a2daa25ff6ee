// Checks the numbers of a command line.
#pragma once

#include <CLI/CLI.hpp>

#include <charconv>
#include <sstream>
#include <string>

namespace manual {

/// Returns a check for a decimal number from `least` to `most`, without a sign '+', blanks or a unit; NaN is none.
/// \param what completes the error "'TEXT' is not ", such as "a time from 0 to 1e9 s, as in 2.5"
inline CLI::Validator number(double least, double most, const std::string& what) {
  return {[=](const std::string& text) {
            double value = 0.0;
            const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
            const bool isNumber = error == std::errc() && end == text.data() + text.size();
            return isNumber && value >= least && value <= most ? std::string() : "'" + text + "' is not " + what;
          },
          ""};
}

/// Returns the same check with a plain error, "a number from 1 to 1000"; --help shows the range.
inline CLI::Validator number(double least, double most) {
  std::ostringstream bounds;
  bounds << "from " << least << " to " << most;
  return number(least, most, "a number " + bounds.str()).description(bounds.str());
}

}  // namespace manual

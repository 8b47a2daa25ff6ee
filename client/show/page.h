// Colours and formatting shared by the live views.
#pragma once

#include "client/show/canvas.h"

#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <ctime>
#include <string>
#include <string_view>

namespace traction::client {

inline constexpr double kGramForce_N = 9.80665e-3;

inline constexpr Colour24 kPaper{14, 16, 24};
inline constexpr Colour24 kBar{36, 41, 58};
inline constexpr Style kPlain;
inline constexpr Style kDim{{120, 126, 142}, kPaper, false};
inline constexpr Style kBright{{255, 255, 255}, kPaper, true};
inline constexpr Style kWarning{{255, 196, 84}, kPaper, true};
inline constexpr Style kLine{{70, 76, 96}, kPaper, false};
inline constexpr Style kAccent{{110, 190, 255}, kPaper, false};

/// Removes the minus of numbers that are zero as they are written: "-0.00" becomes "+0.00" if the others have signs.
inline std::string withoutNegativeZeros(std::string text, bool hasSigns) {
  constexpr std::string_view kDigits = "0123456789";
  for (std::size_t at = text.find('-'); at != std::string::npos; at = text.find('-', at + 1)) {
    const std::size_t end = text.find_first_not_of("0.", at + 1);
    const bool isZero =
        end != at + 1 && (end == std::string::npos || kDigits.find(text[end]) == std::string_view::npos);
    const bool isSign = at == 0 || text[at - 1] == ' ';  // a date has others
    if (!isZero || !isSign || at + 1 == text.size()) continue;
    if (hasSigns || at > 0) {
      text[at] = hasSigns ? '+' : ' ';
    } else {
      text.erase(at, 1);
    }
  }
  return text;
}

/// Returns the text that printf() would print, cut to 159 bytes, without negative zeros.
// NOLINTNEXTLINE(cert-dcl50-cpp): the compiler checks the arguments against the pattern
[[gnu::format(printf, 1, 2)]] inline std::string format(const char* pattern, ...) {
  std::array<char, 160> text{};
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(text.data(), text.size(), pattern, arguments);
  va_end(arguments);
  return withoutNegativeZeros(text.data(), std::string_view(pattern).find("%+") != std::string_view::npos);
}

/// Returns "±0.012", two standard deviations; with more digits where that would be ±0.000.
inline std::string spread(double deviation, int decimals) {
  const double width = 2.0 * deviation;
  const bool isSeen = width == 0.0 || width >= 0.5 * std::pow(10.0, -decimals);
  return isSeen ? format("±%.*f", decimals, width) : format("±%.1g", width);
}

/// Returns a time in UTC, as strftime() writes it.
inline std::string utc(std::time_t time, const char* pattern) {
  std::tm fields{};
  std::array<char, 40> text{};
  gmtime_r(&time, &fields);
  std::strftime(text.data(), text.size(), pattern, &fields);
  return text.data();
}

/// Returns the number, in brackets if it is out of date, which works without colours.
inline std::string inBrackets(const std::string& number, bool isOld) {
  return isOld ? "(" + number + ")" : number;
}

}  // namespace traction::client

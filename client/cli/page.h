// Colours and formatting shared by the live views.
#pragma once

#include "client/cli/canvas.h"

#include <array>
#include <cstdarg>
#include <cstdio>
#include <string>

namespace traction::cli {

inline constexpr double kGramForce_N = 9.80665e-3;

inline constexpr Colour24 kPaper{14, 16, 24};
inline constexpr Colour24 kBar{36, 41, 58};
inline constexpr Style kPlain;
inline constexpr Style kDim{{120, 126, 142}, kPaper, false};
inline constexpr Style kBright{{255, 255, 255}, kPaper, true};
inline constexpr Style kWarning{{255, 196, 84}, kPaper, true};
inline constexpr Style kLine{{70, 76, 96}, kPaper, false};
inline constexpr Style kAccent{{110, 190, 255}, kPaper, false};

/// Returns the text that printf() would print, cut to 159 bytes.
// NOLINTNEXTLINE(cert-dcl50-cpp): the compiler checks the arguments against the pattern
[[gnu::format(printf, 1, 2)]] inline std::string format(const char* pattern, ...) {
  std::array<char, 160> text{};
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(text.data(), text.size(), pattern, arguments);
  va_end(arguments);
  return text.data();
}

/// Returns the number, in brackets if it is out of date, which works without colours.
inline std::string inBrackets(const std::string& number, bool isOld) {
  return isOld ? "(" + number + ")" : number;
}

}  // namespace traction::cli

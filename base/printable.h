// Makes text from outside safe to print: on a terminal, in a log.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>

namespace traction {

/// Returns the length in bytes, 1 to 4, that the UTF-8 character that starts with `lead` should have. Does not check
/// that `lead` may start one.
inline std::size_t utf8Length(char lead) {
  const auto byte = static_cast<unsigned char>(lead);
  return byte < 0x80 ? 1 : byte < 0xe0 ? 2 : byte < 0xf0 ? 3 : 4;
}

/// Returns whether a character of UTF-8 commands a terminal, ends a line or turns what follows around: C0, DEL, C1, the
/// line and paragraph separators, and what marks, embeds, overrides or isolates a direction.
inline bool isCommand(std::string_view glyph) {
  const auto byte = [glyph](std::size_t i) { return static_cast<unsigned char>(glyph[i]); };
  if (glyph.size() == 1) return byte(0) < 0x20 || byte(0) == 0x7f;
  if (glyph.size() == 2) return byte(0) == 0xc2 && byte(1) < 0xa0;
  if (glyph.size() != 3 || byte(0) != 0xe2) return false;
  const unsigned point = 0x2000U | (byte(1) & 0x3fU) << 6 | (byte(2) & 0x3fU);
  return point == 0x200e || point == 0x200f || (point >= 0x2028 && point <= 0x202e) ||
         (point >= 0x2066 && point <= 0x2069);
}

/// Returns the text with a question mark in place of each isCommand(), line ends included, and of each byte that does
/// not belong to a UTF-8 character. The result is valid UTF-8.
/// \param keepsLines true: line ends stay
inline std::string printable(std::string_view utf8, bool keepsLines = false) {
  std::string text;
  text.reserve(utf8.size());
  while (!utf8.empty()) {
    const std::string_view glyph = utf8.substr(0, utf8Length(utf8[0]));
    const auto first = static_cast<unsigned char>(glyph[0]);
    const auto second = static_cast<unsigned char>(glyph.size() > 1 ? glyph[1] : 0);
    // Overlong forms, surrogates, beyond U+10FFFF.
    const bool isForbidden = (first >= 0x80 && first < 0xc2) || (first == 0xe0 && second < 0xa0) ||
                             (first == 0xed && second >= 0xa0) || (first == 0xf0 && second < 0x90) ||
                             (first == 0xf4 && second >= 0x90) || first > 0xf4;
    const bool isWhole = glyph.size() == utf8Length(glyph[0]) && !isForbidden &&
                         std::all_of(glyph.begin() + 1, glyph.end(), [](char c) { return (c & 0xc0) == 0x80; });
    text += isWhole && (!isCommand(glyph) || (keepsLines && first == '\n')) ? glyph : "?";
    utf8.remove_prefix(isWhole ? glyph.size() : 1);
  }
  return text;
}

}  // namespace traction

// Makes text from outside safe to print on a terminal. Used by this library and the command line.
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

/// Returns the text with a question mark in place of each control character, line ends included, and of each byte that
/// does not belong to a UTF-8 character. The result is valid UTF-8.
inline std::string printable(std::string_view utf8) {
  std::string text;
  while (!utf8.empty()) {
    const std::string_view glyph = utf8.substr(0, utf8Length(utf8[0]));
    const auto first = static_cast<unsigned char>(glyph[0]);
    const auto second = static_cast<unsigned char>(glyph.size() > 1 ? glyph[1] : 0);
    // Overlong forms, surrogates, beyond U+10FFFF.
    const bool isForbidden = (first >= 0x80 && first < 0xc2) || (first == 0xe0 && second < 0xa0) ||
                             (first == 0xed && second >= 0xa0) || (first == 0xf0 && second < 0x90) ||
                             (first == 0xf4 && second >= 0x90) || first > 0xf4;
    const bool isWhole = glyph.size() == utf8Length(glyph[0]) && first != 0x7f && first >= 0x20 && !isForbidden &&
                         std::all_of(glyph.begin() + 1, glyph.end(), [](char c) { return (c & 0xc0) == 0x80; });
    const bool isControl = first == 0xc2 && glyph.size() == 2 && static_cast<unsigned char>(glyph[1]) < 0xa0;
    text += isWhole && !isControl ? glyph : "?";
    utf8.remove_prefix(isWhole ? glyph.size() : 1);
  }
  return text;
}

}  // namespace traction

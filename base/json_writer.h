// Writes JSON incrementally (RFC 8259).
#pragma once

#include "base/printable.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace traction {

/// Appends values one after another and inserts commas. Does not check the structure; text must be valid UTF-8. Each
/// function returns this object.
class JsonWriter {
 public:
  /// Writes the key of the next value, within an object.
  JsonWriter& key(std::string_view name) {
    separate();
    quote(name);
    text_ += ':';
    first_ = true;
    return *this;
  }

  /// Writes a number in the shortest form that reads back as the same number; null if it is not finite.
  template <typename Number>
  JsonWriter& number(Number value) {
    separate();
    if constexpr (std::is_floating_point_v<Number>) {
      if (!std::isfinite(value)) {
        text_ += "null";
        return *this;
      }
    }
    std::array<char, 32> digits{};
    text_.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr);
    return *this;
  }
  /// Writes true or false.
  JsonWriter& boolean(bool value) {
    separate();
    text_ += value ? "true" : "false";
    return *this;
  }
  /// Writes a text in quotes; quotes, backslashes and what isCommand() are escaped.
  JsonWriter& string(std::string_view value) {
    separate();
    quote(value);
    return *this;
  }
  /// Writes null.
  JsonWriter& null() {
    separate();
    text_ += "null";
    return *this;
  }

  /// Opens an object '{' or an array '['.
  JsonWriter& open(char bracket) {
    separate();
    text_ += bracket;
    first_ = true;
    return *this;
  }
  /// Closes the object with '}' or the array with ']' that was opened last; whether it is that kind is not checked.
  JsonWriter& close(char bracket) {
    text_ += bracket;
    first_ = false;
    return *this;
  }

  // Write arrays; booleans() writes 0 as false and any other number as true.
  template <typename Range>
  JsonWriter& numbers(const Range& values) {
    open('[');
    for (const auto& value : values) number(value);
    return close(']');
  }
  JsonWriter& booleans(const std::vector<std::uint8_t>& values) {
    open('[');
    for (const auto value : values) boolean(value != 0);
    return close(']');
  }
  JsonWriter& strings(const std::vector<std::string>& values) {
    open('[');
    for (const std::string& value : values) string(value);
    return close(']');
  }
  /// Writes an array of arrays of numbers.
  template <typename Range>
  JsonWriter& vectors(const Range& values) {
    open('[');
    for (const auto& value : values) numbers(value);
    return close(']');
  }

  /// Returns the text. The writer is then empty, as when it was made.
  std::string take() {
    first_ = true;
    return std::exchange(text_, {});
  }

 private:
  void separate() {
    if (!first_) text_ += ',';
    first_ = false;
  }

  void quote(std::string_view value) {
    text_ += '"';
    while (!value.empty()) {
      const std::string_view glyph = value.substr(0, utf8Length(value[0]));
      if (isCommand(glyph)) {
        unsigned point = 0;
        for (const char c : glyph)
          point = point << 6 | (static_cast<unsigned char>(c) & (glyph.size() > 1 ? 0x3fU : 0x7fU));
        if (glyph.size() == 3) point &= 0xffffU;
        std::array<char, 8> code{};
        text_.append(code.data(), static_cast<std::size_t>(std::snprintf(code.data(), code.size(), "\\u%04x", point)));
      } else {
        if (glyph == "\"" || glyph == "\\") text_ += '\\';
        text_ += glyph;
      }
      value.remove_prefix(glyph.size());
    }
    text_ += '"';
  }

  std::string text_;
  bool first_ = true;
};

}  // namespace traction

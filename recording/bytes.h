// Writes and reads numbers and strings in the layout of the file: little endian; a string follows its length in four
// bytes.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace recording {

/// Appends to a string, which must outlive this object.
class Output {
 public:
  explicit Output(std::string& to)
      : to_(to) {}

  /// Appends the bytes of a number: as many as its type has.
  template <std::unsigned_integral Number>
  Output& number(Number value) {
    for (std::size_t i = 0; i < sizeof value; ++i) to_ += static_cast<char>(std::uint64_t{value} >> (8 * i) & 0xff);
    return *this;
  }
  /// Appends bytes without their length.
  Output& bytes(std::string_view bytes) {
    to_ += bytes;
    return *this;
  }
  /// Appends the length of `text` in four bytes, and the text, which must be shorter than 4 GiB.
  Output& text(std::string_view text) { return number(static_cast<std::uint32_t>(text.size())).bytes(text); }

 private:
  std::string& to_;
};

/// Takes values from the front of untrusted bytes, which must outlive it. Once too few bytes are left for a value, all
/// that are left are dropped, values read as 0 or empty, and ok() is false from then on.
class Input {
 public:
  explicit Input(std::string_view bytes)
      : left_(bytes) {}

  bool ok() const { return ok_; }               ///< Returns whether all values taken so far were there.
  bool empty() const { return left_.empty(); }  ///< Returns whether no bytes are left.

  /// Takes a number: as many bytes as its type has.
  template <std::unsigned_integral Number>
  Number number() {
    std::uint64_t value = 0;
    const std::string_view taken = bytes(sizeof(Number));
    for (std::size_t i = 0; i < taken.size(); ++i) {
      value |= std::uint64_t{static_cast<unsigned char>(taken[i])} << (8 * i);
    }
    return static_cast<Number>(value);
  }
  /// Takes `count` bytes. The result refers to the input.
  std::string_view bytes(std::uint64_t count) {
    if (count > left_.size()) {
      ok_ = false;
      left_ = {};
      return {};
    }
    const std::string_view taken = left_.substr(0, static_cast<std::size_t>(count));
    left_.remove_prefix(taken.size());
    return taken;
  }
  /// Takes a length of four bytes and as many bytes. The result refers to the input, as that of bytes().
  std::string_view text() { return bytes(number<std::uint32_t>()); }
  /// Takes all bytes that are left.
  std::string_view rest() { return bytes(left_.size()); }

 private:
  std::string_view left_;
  bool ok_ = true;
};

}  // namespace recording

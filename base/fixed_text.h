// Text with memory of fixed size within the object.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <string_view>

namespace tractiond {

/// Text of at most kRoom bytes that can be copied between threads without allocation. Cuts off what does not fit,
/// between two characters of UTF-8.
template <std::size_t kRoom>
class FixedText {
 public:
  FixedText() = default;
  explicit FixedText(std::string_view text) { assign(text); }

  /// Replaces the text by a copy of `text`, which must not be part of this object. Allocates nothing.
  void assign(std::string_view text) {
    size_ = std::min(text.size(), kRoom);
    while (size_ < text.size() && size_ > 0 && (static_cast<unsigned char>(text[size_]) & 0xC0U) == 0x80U) --size_;
    std::copy_n(text.begin(), size_, text_.begin());
  }
  /// Returns the text; valid as long as the object is neither changed nor destroyed.
  std::string_view view() const { return {text_.data(), size_}; }

 private:
  std::array<char, kRoom> text_{};
  std::size_t size_ = 0;
};

}  // namespace tractiond

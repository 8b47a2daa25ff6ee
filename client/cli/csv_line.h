// A line of comma-separated values.
#pragma once

#include <array>
#include <charconv>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

namespace traction::client {

class CsvLine {
 public:
  CsvLine& add(std::string_view word) {
    if (!text_.empty()) text_ += ',';
    text_ += word;
    return *this;
  }
  /// Writes the fewest digits that give the number again, in any locale.
  template <typename Number>
  requires std::is_arithmetic_v<Number> CsvLine& add(Number number) {
    std::array<char, 32> digits{};
    const char* const end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
    return add(std::string_view(digits.data(), static_cast<std::size_t>(end - digits.data())));
  }
  template <std::size_t kSize>
  CsvLine& add(const std::array<double, kSize>& vector) {
    for (const double each : vector) add(each);
    return *this;
  }
  std::string take() { return std::move(text_) + "\n"; }

 private:
  std::string text_;
};

}  // namespace traction::client

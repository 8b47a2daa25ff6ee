#include "client/input/strokes/alphabet.h"

#include "base/service/config_table.h"
#include "base/toml_table.h"

#include <cstdio>
#include <utility>

namespace traction::input {
namespace {

using tractiond::TomlTable;

constexpr tractiond::Range kPlace{-1e6, 1e6};  ///< in any unit

Template readTemplate(TomlTable& table) {
  Template result{.mode = std::string(kLetters), .symbol = {}, .stroke = {}};
  table.read("mode", result.mode);
  if (result.mode != kLetters && result.mode != kDigits) table.fail("mode", "must be \"letters\" or \"digits\"");
  table.read("symbol", result.symbol);
  if (result.symbol.empty()) table.fail("symbol", "is missing: what the stroke writes");
  std::vector<double> numbers;
  table.read("points", numbers, kPlace);
  if (numbers.size() < 4 || numbers.size() % 2 != 0)
    table.fail("points", "must be x, y, x, y ..., of two points at least");
  for (std::size_t i = 0; i + 1 < numbers.size(); i += 2) result.stroke.push_back({numbers[i], numbers[i + 1]});
  return result;
}

tl::expected<Alphabet, tractiond::Error> read(tl::expected<TomlTable, tractiond::FileError> file) {
  if (!file) return tl::unexpected(tractiond::asError(file.error()));
  Alphabet alphabet;
  for (TomlTable& table : file->tables("stroke")) alphabet.push_back(readTemplate(table));
  if (alphabet.empty()) file->fail("stroke", "is missing: the tables [[stroke]]");
  if (const auto whole = file->finish(); !whole) return tl::unexpected(tractiond::asError(whole.error()));
  return alphabet;
}

}  // namespace

tl::expected<Alphabet, tractiond::Error> parseAlphabet(std::string_view text, const std::string& name) {
  return read(TomlTable::parse(text, name));
}

tl::expected<Alphabet, tractiond::Error> loadAlphabet(const std::filesystem::path& path) {
  return read(TomlTable::load(path.string()));
}

std::string textOf(const Alphabet& alphabet) {
  std::string text;
  for (const Template& each : alphabet) {
    text += "[[stroke]]\nmode = " + tractiond::quoted(each.mode) + "\nsymbol = " + tractiond::quoted(each.symbol) +
            "\npoints = [";
    for (std::size_t i = 0; i < each.stroke.size(); ++i) {
      std::array<char, 64> numbers{};
      const auto [x, y] = each.stroke[i];
      std::snprintf(numbers.data(), numbers.size(), "%s%.6g, %.6g", i == 0 ? "" : ", ", x, y);
      text += numbers.data();
    }
    text += "]\n\n";
  }
  return text;
}

}  // namespace traction::input

// Lists what can be configured as a table: default, unit, range and meaning of every key. Reading, checking and
// printing use the table.
#pragma once

#include "base/error.h"
#include "base/toml_table.h"

#include <tl/expected.hpp>

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace tractiond {

/// One of a few words.
struct Choice {
  std::vector<std::string> words;
  std::function<std::string()> get;
  std::function<void(const std::string&)> set;
};

/// A list of keys that are not known here, each with a value of its own.
struct Entries {
  using Entry = std::pair<std::string, TomlTable::Scalar>;
  std::function<std::vector<Entry>()> get;
  std::function<void(Entry)> add;
  std::string_view example;  ///< lines of comment, above the key in the text of a configuration file
};

/// One key of the configuration file. Values point into a configuration.
struct Key {
  std::string_view section, name;
  std::string_view unit;  ///< as in the file; empty: none
  std::string_view help;  ///< one line
  std::variant<bool*, int*, double*, std::optional<double>*, std::string*, std::vector<std::string>*, Entries, Choice>
      value;
  Range range{0, 0};                                       ///< of numbers, as in the file
  std::function<std::string()> fault = [] { return ""; };  ///< what is wrong with the value, if anything
  bool live = false;                                       ///< changes while the program runs
};

Choice choiceOf(std::string& value, std::vector<std::string> words);

template <typename Enum>
Choice choiceOf(Enum& value, std::vector<std::pair<std::string, Enum>> meanings) {
  Choice result;
  for (const auto& [word, meaning] : meanings) result.words.push_back(word);
  result.get = [&value, meanings] {
    for (const auto& [word, meaning] : meanings) {
      if (meaning == value) return word;
    }
    return std::string();
  };
  result.set = [&value, meanings](const std::string& chosen) {
    for (const auto& [word, meaning] : meanings) {
      if (word == chosen) value = meaning;
    }
  };
  return result;
}

/// 127.…, localhost, a file: other hosts do not reach it.
bool isOnThisHost(std::string_view endpoint);

/// "\"text\"", as TOML wants it.
std::string quoted(const std::string& text);

/// The text of a configuration file with every key and its meaning, behind `introduction`. \param standards the same
/// keys of a default configuration
std::string tableText(const std::string& introduction, const std::vector<Key>& keys, const std::vector<Key>& standards);

/// A key that is not the same in two configurations, with its values as they are written.
struct Change {
  std::string key;  ///< "camera.exposure_us"
  std::string before, after;
  bool live = false;  ///< as in Key
};

/// Of two tables of the same keys.
std::vector<Change> changesBetween(const std::vector<Key>& before, const std::vector<Key>& after);

/// What is wrong with a file of words.
Error asError(const FileError& error);

/// Reads every key of the table from a file; what is absent keeps its value. EX_CONFIG for what is wrong in it.
tl::expected<void, Error> readTable(TomlTable& root, const std::vector<Key>& keys);

}  // namespace tractiond

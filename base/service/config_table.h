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

/// A value that is one of a few words.
struct Choice {
  std::vector<std::string> words;
  std::function<std::string()> get;
  std::function<void(const std::string&)> set;
};

/// A list of keys that this program does not know, each with a value.
struct Entries {
  using Entry = std::pair<std::string, TomlTable::Scalar>;
  std::function<std::vector<Entry>()> get;
  std::function<void(Entry)> add;
  std::string_view example;  ///< lines of comment above the key in a configuration file
};

/// One key of the configuration file. Values point into a configuration.
struct Key {
  std::string_view section, name;
  std::string_view unit;  ///< as in the file; empty: none
  std::string_view help;  ///< one line
  std::variant<bool*, int*, double*, std::optional<double>*, std::string*, std::vector<std::string>*, Entries, Choice>
      value;
  Range range{0, 0};                                       ///< allowed values of a number, as in the file
  std::function<std::string()> fault = [] { return ""; };  ///< returns what is wrong with the value; empty: nothing
  bool live = false;                                       ///< whether the value may change while the program runs
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

/// Returns whether other hosts cannot reach an endpoint: 127.…, localhost, a file.
bool isOnThisHost(std::string_view endpoint);

/// Returns a text as a string of TOML, in quotes.
std::string quoted(const std::string& text);

/// Returns the text of a configuration file with every key and its meaning, after `introduction`. \param standards the
/// same keys of a default configuration
std::string tableText(const std::string& introduction, const std::vector<Key>& keys, const std::vector<Key>& standards);

/// A key whose value differs between two configurations, with both values as they are written.
struct Change {
  std::string key;  ///< "camera.exposure_us"
  std::string before, after;
  bool live = false;  ///< as in Key
};

/// Lists the keys whose values differ between two tables of the same keys.
std::vector<Change> changesBetween(const std::vector<Key>& before, const std::vector<Key>& after);

/// Converts a fault of a configuration file into an error.
Error asError(const FileError& error);

/// Reads every key of the table from a file; a missing key keeps its value. Fails with EX_CONFIG if the file is wrong.
tl::expected<void, Error> readTable(TomlTable& root, const std::vector<Key>& keys);

}  // namespace tractiond

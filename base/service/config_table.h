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

/// Value that is one of a few words.
struct Choice {
  std::vector<std::string> words;
  std::function<std::string()> get;             ///< returns the word of the present value
  std::function<void(const std::string&)> set;  ///< sets the value by one of `words`
};

/// Section with keys that are not known beforehand, each with a value.
struct Entries {
  using Entry = std::pair<std::string, TomlTable::Scalar>;
  std::function<std::vector<Entry>()> get;  ///< returns all entries
  std::function<void(Entry)> add;           ///< appends an entry
  std::string_view example;                 ///< lines of comment above the key in a configuration file
};

/// One key of the configuration file. Values point into a configuration, and texts into static storage; both must
/// outlive it.
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

/// Returns a choice that sets `value` to the meaning of one of the words. `value` must outlive it. Its `get` returns an
/// empty text for a value without a word, and its `set` ignores other words.
template <typename Value>
Choice choiceOf(Value& value, std::vector<std::pair<std::string, Value>> meanings) {
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

/// Returns whether an endpoint cannot be reached from other hosts: ipc, or tcp at 127.…, [::1], localhost or lo. Judges
/// by the text alone: any other text is false.
bool isOnThisHost(std::string_view endpoint);

/// Returns the text of a configuration file with every key, its value, meaning and limits, after `introduction`. A key
/// without a value is commented out.
/// \param keys keys of one section must follow each other
/// \param standards the same keys, in the same order, of a default configuration, whose values are stated as defaults
std::string tableText(const std::string& introduction, const std::vector<Key>& keys, const std::vector<Key>& standards);

/// A key whose values differ in two configurations.
struct Change {
  std::string key;            ///< "camera.exposure_us"
  std::string before, after;  ///< values as in the file; empty: none
  bool live = false;          ///< Key::live
};

/// Lists the keys whose values differ, in the order of the tables, which must have the same keys in the same order.
std::vector<Change> changesBetween(const std::vector<Key>& before, const std::vector<Key>& after);

/// What to do where the file of a program's configuration cannot be read.
inline constexpr const char* kDefaultsHold = "without a configuration file the defaults hold";

/// Converts an error in a file of TOML: EX_NOINPUT if the file cannot be read, else EX_CONFIG.
/// \param unreadable what to do if it cannot be read
Error asError(const FileError& error, const std::string& unreadable = "");

/// Reads every key of the table from a file into the values that the keys point to; missing keys keep their values, and
/// Entries are added to those that there are. Fails with EX_CONFIG for the first fault, also for an unknown key or a
/// Key::fault of a section that the file has; some values are then changed already.
/// \param root root table of the file
/// \param isStrict false: unknown keys have no effect
tl::expected<void, Error> readTable(TomlTable& root, const std::vector<Key>& keys, bool isStrict = true);

/// Words for the lowest level of log lines, each of which is its own meaning, for choiceOf().
std::vector<std::pair<std::string, std::string>> logLevels();

}  // namespace tractiond

#include "base/service/config_table.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <map>

namespace tractiond {
namespace {

/// Returns the shortest decimal that reads back as the same number; whole ones without a point.
std::string number(double value) {
  const std::string text = fmt::format("{}", value);
  return text.ends_with(".0") ? text.substr(0, text.size() - 2) : text;
}

struct ScalarText {
  std::string operator()(bool value) const { return value ? "true" : "false"; }
  std::string operator()(std::int64_t value) const { return std::to_string(value); }
  std::string operator()(const std::string& value) const { return quoted(value); }
  std::string operator()(double value) const {
    std::string text = number(value);  // with a point or an exponent: otherwise it would read back as an integer
    return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
  }
};

bool isBareKey(const std::string& name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char letter) {
    return std::isalnum(letter) || letter == '_' || letter == '-';
  });
}

std::string entriesText(const std::vector<Entries::Entry>& entries) {
  std::string text;
  for (const auto& [name, value] : entries) {
    text += (text.empty() ? "\n" : ",\n") + ("  { " + (isBareKey(name) ? name : quoted(name)));
    text += " = " + std::visit(ScalarText{}, value) + " }";
  }
  return text.empty() ? "[]" : "[" + text + "\n]";
}

/// A value as it is written in TOML; empty: not set.
struct Written {
  const Range& range;

  std::string operator()(const bool* value) const { return *value ? "true" : "false"; }
  std::string operator()(const int* value) const { return number(*value * range.perUnit); }
  std::string operator()(const double* value) const { return number(*value * range.perUnit); }
  std::string operator()(const std::optional<double>* value) const {
    return *value ? number(**value * range.perUnit) : "";
  }
  std::string operator()(const std::string* value) const { return quoted(*value); }
  std::string operator()(const std::vector<std::string>* value) const {
    std::string list;
    for (const std::string& one : *value) list += (list.empty() ? "" : ", ") + quoted(one);
    return "[" + list + "]";
  }
  std::string operator()(const Choice& value) const { return quoted(value.get()); }
  std::string operator()(const Entries& entries) const { return entriesText(entries.get()); }
};

std::string written(const Key& key) {
  return std::visit(Written{key.range}, key.value);
}

/// Returns the limits of a key as text: "default 5; 0 to 10 ms".
std::string limits(const Key& key, const std::string& standard) {
  std::string text = "default " + (standard.empty() ? "none" : standard);
  if (const auto* choice = std::get_if<Choice>(&key.value)) {
    text += ";";
    for (std::size_t i = 0; i < choice->words.size(); ++i) text += (i ? ", " : " ") + quoted(choice->words[i]);
  } else if (key.range.least < key.range.most) {
    text += "; " + number(key.range.least) + " to " + number(key.range.most);
    if (!key.unit.empty()) text += " " + std::string(key.unit);
  }
  return text + (key.live ? "; reload" : "");
}

/// Reads the value of one key, each type in its way.
struct Reader {
  TomlTable& table;
  const Key& key;

  void operator()(bool* value) const { table.read(key.name, *value); }
  void operator()(std::string* value) const { table.read(key.name, *value); }
  void operator()(std::vector<std::string>* value) const { table.read(key.name, *value); }
  void operator()(int* value) const { table.read(key.name, *value, key.range); }
  void operator()(double* value) const { table.read(key.name, *value, key.range); }
  void operator()(std::optional<double>* value) const {
    if (!table.has(key.name)) return;
    table.read(key.name, value->emplace(), key.range);
  }
  void operator()(const Entries& entries) const {
    for (TomlTable& group : table.tables(key.name)) {
      for (Entries::Entry& entry : group.entries()) entries.add(std::move(entry));
    }
  }
  void operator()(const Choice& choice) const {
    std::string word = choice.get();
    table.read(key.name, word);
    if (std::find(choice.words.begin(), choice.words.end(), word) != choice.words.end()) return choice.set(word);
    std::string known;
    for (const std::string& one : choice.words) known += (known.empty() ? "" : ", ") + ('"' + one + '"');
    table.fail(key.name, "= \"" + word + "\" must be one of " + known);
  }
};

}  // namespace

std::vector<std::pair<std::string, std::string>> logLevels() {
  return {{"debug", "debug"}, {"info", "info"}, {"warning", "warning"}, {"error", "error"}};
}

bool isOnThisHost(std::string_view endpoint) {
  return endpoint.starts_with("ipc://") ||
         std::ranges::any_of(std::array{"tcp://127.", "tcp://localhost:", "tcp://lo:", "tcp://[::1]:"},
                             [&](const char* start) { return endpoint.starts_with(start); });
}

std::string tableText(const std::string& introduction, const std::vector<Key>& keys,
                      const std::vector<Key>& standards) {
  std::string text = introduction;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const Key& key = keys[i];
    const bool first = i == 0 || keys[i - 1].section != key.section;
    if (first) text += "\n[" + std::string(key.section) + "]\n";
    const std::string value = written(key);
    text += (first ? "# " : "\n# ") + std::string(key.help) + "\n";
    if (const auto* entries = std::get_if<Entries>(&key.value)) text += entries->example;
    text += (value.empty() ? "#" : "") + std::string(key.name) + " = " + (value.empty() ? "0" : value);
    text += "  # " + limits(key, written(standards[i])) + "\n";
  }
  return text;
}

std::vector<Change> changesBetween(const std::vector<Key>& before, const std::vector<Key>& after) {
  std::vector<Change> changes;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Key& key = before[i];
    Change change{std::string(key.section) + "." + std::string(key.name), written(key), written(after[i]), key.live};
    if (change.before != change.after) changes.push_back(std::move(change));
  }
  return changes;
}

Error asError(const FileError& error, const std::string& unreadable) {
  return {.exitCode = error.unreadable ? EX_NOINPUT : EX_CONFIG,
          .what = error.what,
          .where = error.where,
          .remedy = error.unreadable ? unreadable : ""};
}

tl::expected<void, Error> readTable(TomlTable& root, const std::vector<Key>& keys, bool isStrict) {
  std::map<std::string_view, std::optional<TomlTable>> sections;
  for (const Key& key : keys) {
    auto section = sections.find(key.section);
    if (section == sections.end()) section = sections.emplace(key.section, root.table(key.section)).first;
    if (!section->second) continue;
    std::visit(Reader{*section->second, key}, key.value);
    if (const std::string fault = key.fault(); !fault.empty()) section->second->fail(key.name, fault);
  }
  if (auto sound = root.finish(isStrict); !sound) return tl::unexpected(asError(sound.error()));
  return {};
}

}  // namespace tractiond

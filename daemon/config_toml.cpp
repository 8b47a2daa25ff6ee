#include "daemon/config_toml.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <map>
#include <optional>

namespace tractiond {
namespace {

using sensor::FileError;
using sensor::TomlTable;

Error asError(const FileError& error) {
  return {.exitCode = error.unreadable ? EX_NOINPUT : EX_CONFIG,
          .what = error.what,
          .where = error.where,
          .remedy = error.unreadable ? "without a configuration file the defaults hold" : ""};
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
  void operator()(std::vector<capture::Feature>* value) const {
    for (TomlTable& group : table.tables(key.name)) {
      for (auto& [name, scalar] : group.entries()) value->push_back({std::move(name), std::move(scalar)});
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

tl::expected<Config, Error> read(TomlTable& root) {
  Config config;
  std::map<std::string_view, std::optional<TomlTable>> sections;
  for (const Key& key : keysOf(config)) {
    auto section = sections.find(key.section);
    if (section == sections.end()) section = sections.emplace(key.section, root.table(key.section)).first;
    if (!section->second) continue;
    std::visit(Reader{*section->second, key}, key.value);
    if (const std::string fault = key.fault(); !fault.empty()) section->second->fail(key.name, fault);
  }
  if (auto sound = root.finish(); !sound) return tl::unexpected(asError(sound.error()));
  return config;
}

}  // namespace

tl::expected<Config, Error> parseConfig(std::istream& text, const std::string& name) {
  auto root = TomlTable::parse(std::string{std::istreambuf_iterator<char>(text), {}}, name);
  if (!root) return tl::unexpected(asError(root.error()));
  return read(*root);
}

tl::expected<Config, Error> loadConfig(const std::string& path) {
  auto root = TomlTable::load(path);
  if (!root) return tl::unexpected(asError(root.error()));
  auto config = read(*root);
  if (config && !config->sensor.gelFile.empty()) {
    config->sensor.gelFile = std::filesystem::path(path).parent_path() / config->sensor.gelFile;
  }
  return config;
}

}  // namespace tractiond

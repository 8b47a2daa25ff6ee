#include "daemon/app/config_toml.h"

#include <fmt/ranges.h>

#include <array>
#include <filesystem>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

namespace tractiond {
namespace {

struct Key {
  std::string_view table, name;
};

/// Keys of earlier versions: of solving by a contact step, of packets that passed by the kernel's filter.
constexpr std::array<Key, 5> kFormer = {{{"solve", "solver"},
                                         {"solve", "regularisation"},
                                         {"solve", "contact_aware"},
                                         {"solve", "force_scale_newton"},
                                         {"camera", "packet_socket"}}};

/// Makes former keys a fault, all at once.
void refuseFormer(TomlTable& root) {
  std::optional<Key> first;
  std::vector<std::string> others;
  for (const Key& key : kFormer) {
    const auto table = root.table(key.table);
    if (!table || !table->has(key.name)) continue;
    if (first) others.push_back(fmt::format("{}.{}", key.table, key.name));
    if (!first) first = key;
  }
  if (!first) return;
  root.table(first->table)
      ->fail(first->name, fmt::format("is a key of an earlier version; delete it{}{}",
                                      others.empty() ? "" : ", and also ", fmt::join(others, ", ")));
}

void ignoreFormer(TomlTable& root) {
  for (const Key& key : kFormer) {
    if (auto table = root.table(key.table)) table->ignore(key.name);
  }
}

tl::expected<Config, Error> read(TomlTable& root) {
  Config config;
  return readTable(root, keysOf(config)).map([&] {
    if (config.camera.frameRate_Hz > 0.0) config.solve.frameRate_Hz = config.camera.frameRate_Hz;
    return config;
  });
}

}  // namespace

tl::expected<Config, Error> parseConfig(std::istream& text, const std::string& name) {
  auto root = TomlTable::parse(std::string{std::istreambuf_iterator<char>(text), {}}, name);
  if (!root) return tl::unexpected(asError(root.error()));
  refuseFormer(*root);
  return read(*root);
}

tl::expected<Config, Error> parseRecordedConfig(std::istream& text, const std::string& name) {
  auto root = TomlTable::parse(std::string{std::istreambuf_iterator<char>(text), {}}, name);
  if (!root) return tl::unexpected(asError(root.error()));
  ignoreFormer(*root);
  return read(*root);
}

tl::expected<Config, Error> loadConfig(const std::string& path) {
  auto root = TomlTable::load(path);
  if (!root) return tl::unexpected(asError(root.error(), kDefaultsHold));
  refuseFormer(*root);
  auto config = read(*root);
  if (config && config->sensor.namesGelFile()) {
    config->sensor.gelFile = std::filesystem::path(path).parent_path() / config->sensor.gelFile;
  }
  return config;
}

}  // namespace tractiond

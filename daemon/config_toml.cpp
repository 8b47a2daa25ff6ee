#include "daemon/config_toml.h"

#include <filesystem>
#include <iterator>

namespace tractiond {
namespace {

tl::expected<Config, Error> read(TomlTable& root) {
  Config config;
  return readTable(root, keysOf(config)).map([&] { return config; });
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
  if (config && config->sensor.namesGelFile()) {
    config->sensor.gelFile = std::filesystem::path(path).parent_path() / config->sensor.gelFile;
  }
  return config;
}

}  // namespace tractiond

#include "daemon/app/config_toml.h"

#include <fmt/ranges.h>

#include <array>
#include <filesystem>
#include <iterator>

namespace tractiond {
namespace {

/// Keys of [solve] in earlier versions, which solved by a contact step.
constexpr std::array<std::string_view, 4> kFormer = {"solver", "regularisation", "contact_aware", "force_scale_newton"};

/// Makes former keys a fault, all at once.
void refuseFormer(TomlTable& root) {
  auto solve = root.table("solve");
  std::vector<std::string_view> there;
  for (const std::string_view key : kFormer) {
    if (solve && solve->has(key)) there.push_back(key);
  }
  if (there.empty()) return;
  solve->fail(there.front(),
              fmt::format("is a key of an earlier version, which solved by a contact step; delete it{}{}",
                          there.size() > 1 ? ", and also " : "", fmt::join(there.begin() + 1, there.end(), ", ")));
}

void ignoreFormer(TomlTable& root) {
  auto solve = root.table("solve");
  for (const std::string_view key : kFormer) {
    if (solve) solve->ignore(key);
  }
  if (auto camera = root.table("camera")) camera->ignore("packet_socket");
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

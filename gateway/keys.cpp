#include "gateway/keys.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <system_error>

namespace tractiond::gateway {
namespace {

bool isLocal(const Config& config) {
  return std::ranges::all_of(std::array{&config.stream, &config.latest, &config.control, &config.preview},
                             [](const auto* list) { return std::ranges::all_of(*list, isOnThisHost); });
}

}  // namespace

tl::expected<std::optional<network::KeyPair>, Error> serverKey(const Config& config) {
  if (config.insecure) return std::nullopt;
  const std::filesystem::path file = network::serverKeyFile(config.keys);
  std::error_code ignored;
  // If the directory cannot be searched, loadKeyPair() reports the reason.
  if (std::filesystem::symlink_status(file, ignored).type() != std::filesystem::file_type::not_found) {
    return network::loadKeyPair(file).map([](network::KeyPair keys) { return std::optional(std::move(keys)); });
  }
  if (!isLocal(config)) {
    return tl::unexpected(Error{.exitCode = EX_CONFIG,
                                .what = "other hosts would be let in, and there is no key",
                                .where = file.string(),
                                .remedy = "tractionctl keys allow makes one; or gateway.insecure = true lets "
                                          "everybody in"});
  }
  return std::nullopt;
}

bool losesSomething(const std::vector<network::AllowedKey>& before, const std::vector<network::AllowedKey>& now) {
  return std::ranges::any_of(before, [&](const network::AllowedKey& old) {
    const auto same = std::ranges::find(now, old.key, &network::AllowedKey::key);
    return same == now.end() || same->name != old.name || same->permission < old.permission;
  });
}

std::string listed(const std::vector<network::AllowedKey>& keys) {
  std::string text;
  for (const network::AllowedKey& key : keys) {
    text += (text.empty() ? "" : ", ") + key.name + " (" + std::string(network::wordOf(key.permission)) + ")";
  }
  return text.empty() ? "nobody" : text;
}

}  // namespace tractiond::gateway

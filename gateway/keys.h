// Keys of the gateway and of its clients.
#pragma once

#include "base/network/keys.h"
#include "gateway/config.h"

#include <tl/expected.hpp>

#include <optional>
#include <string>
#include <vector>

namespace tractiond::gateway {

/// Reads the gateway's own key; nothing if connections need none. Errors: EX_CONFIG, and those of loadKeyPair().
tl::expected<std::optional<network::KeyPair>, Error> serverKey(const Config& config);

/// Returns whether a key was removed, renamed, or lost a permission.
bool losesSomething(const std::vector<network::AllowedKey>& before, const std::vector<network::AllowedKey>& now);

/// Returns the names and permissions of keys, for the log.
std::string listed(const std::vector<network::AllowedKey>& keys);

}  // namespace tractiond::gateway

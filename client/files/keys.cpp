#include "client/files/keys.h"

#include "client/files/failure.h"

#include <sysexits.h>

#include <cstdlib>
#include <system_error>

namespace traction::client {

namespace fs = std::filesystem;

fs::path usualKeyFile() {
  const auto absolute = [](const char* variable) -> fs::path {
    const char* const value = std::getenv(variable);
    return value != nullptr && *value == '/' ? value : "";
  };
  fs::path base = absolute("XDG_CONFIG_HOME");
  if (base.empty()) base = absolute("HOME") / ".config";
  return base / "traction" / "key";
}

Keys keysFor(const std::string& serverKey, const fs::path& file) {
  std::error_code ignored;
  const fs::path from = file.empty() ? usualKeyFile() : file;
  if (file.empty() && serverKey.empty() && !fs::exists(from, ignored)) return {};
  if (file.empty() && !fs::exists(from, ignored)) {
    throw Failure(EX_NOINPUT, "there is no key of yours in " + from.string() + "; tractionctl keys new NAME makes one");
  }
  Keys keys = loadKeys(from.string());
  if (!serverKey.empty()) keys.serverKey = serverKey;
  if (keys.serverKey.empty()) {  // otherwise the connection would be unencrypted, to any program that answers
    throw Failure(EX_USAGE, "the box's key is missing: --server-key KEY, or a line server = \"KEY\" in " +
                                from.string() + "; a host that asks for none is reached by --connect and --control");
  }
  return keys;
}

}  // namespace traction::client

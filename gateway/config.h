// Configuration of a gateway.
#pragma once

#include "base/network/keys.h"
#include "base/service/config_table.h"

#include <tl/expected.hpp>

#include <istream>
#include <string>
#include <vector>

namespace tractiond::gateway {

/// Limits of what all peers and each of them may request; all are at least 1.
struct Limits {
  int requestsPerSecond = 100;     ///< of all keys together
  int requestsPerSecondEach = 20;  ///< of one key, or of one address where connections need no key
};

/// The endpoints are tcp://ADDRESS:PORT, ADDRESS * for every address of this host. All but `preview` need at least one.
struct Config {
  std::vector<std::string> stream = {"tcp://*:9882"};
  std::vector<std::string> latest = {"tcp://*:9883"};
  std::vector<std::string> control = {"tcp://*:9884"};
  std::vector<std::string> preview = {};  ///< empty: previews are not relayed
  /// True: connections need no key. False: they need one, except where `keys` has no key of the gateway and all
  /// endpoints are on the loopback.
  bool insecure = false;
  std::string keys = network::kKeyDirectory;  ///< directory of the allowed keys and of the gateway's own
  int highWaterMark = 8;                      ///< messages of stream queued for one slow peer; further ones are lost
  Limits limits;
  std::string logLevel = "info";  ///< "debug", "info", "warning" or "error"
};

/// Returns every key of the configuration file, section by section, bound to the fields of `config`, which must outlive
/// them.
std::vector<Key> keysOf(Config& config);

/// Returns the text of a configuration file with the values of `config` and the meaning, default and range of every
/// key.
std::string configText(const Config& config);

// Read a configuration. Missing keys keep their defaults. Error EX_CONFIG for invalid content, also an unknown key.

/// Reads `text` of any size; an error of the stream counts as its end.
/// \param name of the file in errors
tl::expected<Config, Error> parseConfig(std::istream& text, const std::string& name);
/// Reads a file as parseConfig() does. EX_NOINPUT if it cannot be read, or has more than 4 MiB.
tl::expected<Config, Error> loadConfig(const std::string& path);

}  // namespace tractiond::gateway

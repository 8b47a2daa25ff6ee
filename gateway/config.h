// What can be configured of a gateway.
#pragma once

#include "daemon/config_table.h"
#include "gateway/keys.h"

#include <tl/expected.hpp>

#include <istream>
#include <string>
#include <vector>

namespace tractiond::gateway {

struct Limits {
  int peers = 256;                 ///< connections at a time
  int peersPerAddress = 32;        ///< of them from one address: whoever has more cannot keep others out
  int requestsPerSecond = 100;     ///< of all together; the instrument cuts off who sends 1,000
  int requestsPerSecondEach = 20;  ///< of one key
};

struct Config {
  std::vector<std::string> stream = {"tcp://*:9882"};
  std::vector<std::string> latest = {"tcp://*:9883"};
  std::vector<std::string> control = {"tcp://*:9884"};
  std::vector<std::string> preview = {};
  bool insecure = false;  ///< nobody is asked for a key
  std::string keys = kKeyDirectory;
  int highWaterMark = 8;  ///< messages that wait for one slow peer before it loses some
  Limits limits;
  std::string logLevel = "info";
};

/// Every key of the file, section after section.
std::vector<Key> keysOf(Config& config);

/// The text of a configuration file with every key and its meaning.
std::string configText(const Config& config);

/// What is absent keeps its default. EX_CONFIG for what is wrong in it, EX_NOINPUT when it cannot be read.
tl::expected<Config, Error> parseConfig(std::istream& text, const std::string& name);
tl::expected<Config, Error> loadConfig(const std::string& path);

}  // namespace tractiond::gateway

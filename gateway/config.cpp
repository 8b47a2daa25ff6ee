#include "gateway/config.h"

#include "base/toml_table.h"

#include <iterator>

namespace tractiond::gateway {
namespace {

std::string endpointFault(const std::vector<std::string>& endpoints) {
  for (const std::string& endpoint : endpoints) {
    if (!endpoint.starts_with("tcp://")) return "holds \"" + endpoint + "\", which is not tcp://ADDRESS:PORT";
  }
  return "";
}

tl::expected<Config, Error> read(tl::expected<TomlTable, FileError> file) {
  if (!file) return tl::unexpected(asError(file.error(), kDefaultsHold));
  Config config;
  return readTable(*file, keysOf(config)).map([&] { return config; });
}

}  // namespace

std::vector<Key> keysOf(Config& config) {
  const auto endpoints = [](const std::vector<std::string>& list) {
    return [&list]() -> std::string {
      return list.empty() ? "is empty: no endpoint, as in [\"tcp://*:9882\"]" : endpointFault(list);
    };
  };
  const auto endpointsOrNone = [](const std::vector<std::string>& list) {
    return [&list] { return endpointFault(list); };
  };
  Limits& limits = config.limits;
  // clang-format off
  return {
      {"gateway", "stream", "", "Endpoints of all messages; * is every address of this host.",
          &config.stream, {}, endpoints(config.stream)},
      {"gateway", "latest", "", "Endpoints of the newest field alone.",
          &config.latest, {}, endpoints(config.latest)},
      {"gateway", "control", "", "Endpoints for status, description, zero, the camera.",
          &config.control, {}, endpoints(config.control)},
      {"gateway", "preview", "", "Endpoints of the reduced pictures, for who may control: [\"tcp://*:9885\"]; empty: none.",
          &config.preview, {}, endpointsOrNone(config.preview)},
      {"gateway", "keys", "", "Directory of the keys that may come in, and of this box's own: tractionctl keys.",
          &config.keys},
      {"gateway", "insecure", "", "Nobody is asked for a key: whoever reaches the endpoints reads, zeroes and calibrates.",
          &config.insecure},
      {"gateway", "high_water_mark", "messages", "That wait for one slow peer before it loses some.",
          &config.highWaterMark, {1, 1000}},

      {"limits", "requests_per_s", "requests/s", "Of all peers together; those beyond are answered with an error.",
          &limits.requestsPerSecond, {1, 450}},
      {"limits", "requests_per_s_each", "requests/s", "Of one key.",
          &limits.requestsPerSecondEach, {1, 450}},

      {"log", "level", "", "Of what goes to standard error.",
          choiceOf(config.logLevel, logLevels())},
  };
  // clang-format on
}

std::string configText(const Config& config) {
  Config copy = config, standard;
  return tableText(
      "# Every key of traction-gateway: its meaning, default, range and unit. Any may be left out.\n"
      "# The gateway of the instance NAME reads /etc/tractiond/gateway/NAME.toml. Several on one host need "
      "ports of their own.\n",
      keysOf(copy), keysOf(standard));
}

tl::expected<Config, Error> parseConfig(std::istream& text, const std::string& name) {
  return read(TomlTable::parse(std::string{std::istreambuf_iterator<char>(text), {}}, name));
}

tl::expected<Config, Error> loadConfig(const std::string& path) {
  return read(TomlTable::load(path));
}

}  // namespace tractiond::gateway

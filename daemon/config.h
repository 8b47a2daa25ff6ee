// What can be configured: one struct, and one table that says of every key its default, unit, range and meaning.
#pragma once

#include "daemon/capture/camera_options.h"
#include "daemon/publish/publisher.h"
#include "daemon/solve/options.h"
#include "daemon/track/tracker.h"
#include "sensor/toml_table.h"

#include <functional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace tractiond {

/// The defaults are those of the rooms' options.
struct Config {
  struct Sensor {
    std::string name;     ///< in topics and messages; empty: the instance's
    std::string gelFile;  ///< empty: the paper's gel
  } sensor;
  capture::CameraOptions camera;
  track::TrackOptions track;
  solve::SolveOptions solve;
  publish::PublishOptions publish;
  bool insecure = false;                      ///< endpoints may be beyond this host
  std::vector<std::string> controlEndpoints;  ///< empty, as those in `publish`: the instance's
  std::string logLevel = "info";
};

/// One of a few words.
struct Choice {
  std::vector<std::string> words;
  std::function<std::string()> get;
  std::function<void(const std::string&)> set;
};

/// One key of the configuration file. Values point into a Config.
struct Key {
  std::string_view section, name;
  std::string_view unit;  ///< as in the file; empty: none
  std::string_view help;  ///< one line
  std::variant<bool*, int*, double*, std::optional<double>*, std::string*, std::vector<std::string>*,
               std::vector<capture::Feature>*, Choice>
      value;
  sensor::Range range{0, 0};                               ///< of numbers, as in the file
  std::function<std::string()> fault = [] { return ""; };  ///< what is wrong with the value, if anything
};

/// Every key, section after section: parsing, checking and printing all go by it.
std::vector<Key> keysOf(Config& config);

/// The text of a configuration file with every key and its meaning. parse() gives the same configuration back.
std::string configText(const Config& config);

}  // namespace tractiond

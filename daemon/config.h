// The configuration: a struct, and a table of all keys with their defaults, units, ranges and meanings.
#pragma once

#include "base/service/config_table.h"
#include "daemon/capture/camera_options.h"
#include "daemon/previewer.h"
#include "daemon/publish/publisher.h"
#include "daemon/realtime.h"
#include "daemon/recorder.h"
#include "daemon/solve/options.h"
#include "daemon/track/tracker.h"

#include <string>
#include <string_view>
#include <vector>

namespace tractiond {

/// Value of sensor.gel_file with which pictures are shown, and nothing is measured.
inline constexpr std::string_view kNoGelFile = "none";

/// Defaults are those of the folders' options.
struct Config {
  struct Sensor {
    std::string name;     ///< in topics and messages; empty: the instance's
    std::string gelFile;  ///< empty: the paper's gel; kNoGelFile: there is none
    bool namesGelFile() const { return !gelFile.empty() && gelFile != kNoGelFile; }
  } sensor;
  capture::CameraOptions camera;
  track::TrackOptions track;
  solve::SolveOptions solve;
  publish::PublishOptions publish;
  PreviewOptions preview;
  RecordOptions record;                       ///< of the command line
  bool insecure = false;                      ///< endpoints may be beyond this host
  std::vector<std::string> controlEndpoints;  ///< empty, as those in `publish`: the instance's
  RealtimeOptions realtime;
  std::string logLevel = "info";
};

/// Returns every key, by section. Parsing, checking and printing use it.
std::vector<Key> keysOf(Config& config);

/// Lists the keys whose values differ between two configurations.
std::vector<Change> changesBetween(const Config& before, const Config& after);

/// Returns the text of a configuration file with every key and its meaning. Parsing it returns the same configuration.
std::string configText(const Config& config);

}  // namespace tractiond

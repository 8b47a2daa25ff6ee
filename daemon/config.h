// What can be configured: one struct, and one table that says of every key its default, unit, range and meaning.
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

/// As sensor.gel_file: pictures can be seen, and nothing is measured.
inline constexpr std::string_view kNoGelFile = "none";

/// The defaults are those of the rooms' options.
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

/// Every key, section after section: parsing, checking and printing all go by it.
std::vector<Key> keysOf(Config& config);

/// As those of their tables.
std::vector<Change> changesBetween(const Config& before, const Config& after);

/// The text of a configuration file with every key and its meaning. parse() gives the same configuration back.
std::string configText(const Config& config);

}  // namespace tractiond

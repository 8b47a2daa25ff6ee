// The configuration: one struct, one table with default, unit, range and meaning of every key, and its file.
#pragma once

#include "base/error.h"
#include "base/service/config_table.h"
#include "daemon/app/previewer.h"
#include "daemon/app/prompt_solver.h"
#include "daemon/app/realtime.h"
#include "daemon/capture/camera_options.h"
#include "daemon/publish/publisher.h"
#include "daemon/record/recorder.h"
#include "daemon/solve/options.h"
#include "daemon/track/tracker.h"

#include <tl/expected.hpp>

#include <istream>
#include <string>
#include <string_view>
#include <vector>

namespace tractiond {

/// Value of sensor.gel_file with which pictures can be seen and nothing is measured.
inline constexpr std::string_view kNoGelFile = "none";

/// Value of sensor.gel_file for the gel file that a client had adopted (AdoptRequest), and for none before the first.
inline constexpr std::string_view kAdoptedGelFile = "adopted";

/// Defaults are those of the folders' options.
struct Config {
  struct Sensor {
    std::string name;  ///< in topics and messages; empty: the instance's
    /// Empty: the built-in gel, that of the paper; kNoGelFile: none; kAdoptedGelFile until completed() has replaced it.
    std::string gelFile;
    std::string adopted;  ///< path at which an adopted gel file is kept, set by completed(); empty: none may be adopted
    /// Returns whether gelFile is the name of a file.
    bool namesGelFile() const { return !gelFile.empty() && gelFile != kNoGelFile && gelFile != kAdoptedGelFile; }
  } sensor;
  capture::CameraOptions camera;
  track::TrackOptions track;
  solve::SolveOptions solve;
  PromptOptions prompt;
  publish::PublishOptions publish;
  PreviewOptions preview;
  RecordOptions record;                       ///< from the command line
  bool insecure = false;                      ///< true: endpoints may be reachable from other hosts
  std::vector<std::string> controlEndpoints;  ///< empty, like those in `publish`: those of the instance
  RealtimeOptions realtime;
  std::string logLevel = "info";
};

/// Returns the table of all keys, section by section, bound to the fields of `config`, which must outlive it and stay
/// where it is. Parsing, checking and printing use it.
std::vector<Key> keysOf(Config& config);

/// Lists the keys whose values differ, in the order of keysOf(). Options of the command line are no keys. Reentrant.
std::vector<Change> changesBetween(const Config& before, const Config& after);

/// Returns the text of a configuration file with every key, its value and meaning. parseConfig() restores the values of
/// all keys from it; fields that are no keys, as those from the command line, then have their defaults.
std::string configText(const Config& config);

/// Parses a configuration, up to the end of `text`. Missing keys keep their defaults; the gel file's name stays as it
/// is written. EX_CONFIG: wrong syntax, an unknown key (the error states the nearest known one), a wrong type, a value
/// out of its range or not allowed (Key::fault). Reentrant.
/// \param name of the file in errors: "name:line: what"; is not opened
tl::expected<Config, Error> parseConfig(std::istream& text, const std::string& name);

/// Does the same with the configuration that a recording holds: unknown keys, as those of other versions, have no
/// effect.
tl::expected<Config, Error> parseRecordedConfig(const std::string& text, const std::string& name);

/// Reads a configuration file; waits for the disk. Resolves the gel file's name relative to the file's directory,
/// except "none" (a file of that name is ./none). EX_NOINPUT: the file is missing or cannot be read. EX_CONFIG as
/// parseConfig(). Reentrant.
tl::expected<Config, Error> loadConfig(const std::string& path);

}  // namespace tractiond

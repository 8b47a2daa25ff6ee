// Command line of tractiond.
#pragma once

#include "daemon/instance.h"
#include "daemon/recorder.h"
#include "daemon/replay.h"

#include <tl/expected.hpp>

namespace tractiond {

struct Arguments {
  Places places;
  std::string inspected;    ///< not empty: this is a child process that evaluates the description of this camera
  bool limited = false;     ///< true: this is the child process of --plan
  std::string description;  ///< file of a camera's description for --plan; empty: none
  std::string images;       ///< file of raw pictures; empty: a camera
  RecordOptions record;
  ReplayOptions replay;  ///< with an empty file nothing is replayed
  bool checkConfig = false, printConfig = false, listCameras = false;
};

/// Parses the command line. On failure returns an exit code: 0 after printing help or the version, EX_USAGE after
/// printing an error.
tl::expected<Arguments, int> parseArguments(int argc, char** argv);

}  // namespace tractiond

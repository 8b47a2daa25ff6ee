// The command line.
#pragma once

#include "daemon/instance.h"
#include "daemon/recorder.h"
#include "daemon/replay.h"

#include <tl/expected.hpp>

namespace tractiond {

struct Arguments {
  Places places;
  std::string inspected;    ///< camera whose description this child of tractiond evaluates; empty: it is not a child
  bool limited = false;     ///< whether this is a child that evaluates --plan
  std::string description;  ///< file of a camera's description for --plan; empty: none
  std::string images;       ///< empty: a camera
  RecordOptions record;
  ReplayOptions replay;  ///< no file: nothing is replayed
  bool checkConfig = false, printConfig = false, listCameras = false;
};

/// Parses the command line. Otherwise returns an exit code: 0 after printing help or the version, EX_USAGE after
/// printing an error.
tl::expected<Arguments, int> parseArguments(int argc, char** argv);

}  // namespace tractiond

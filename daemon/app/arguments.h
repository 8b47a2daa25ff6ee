// Command line of tractiond.
#pragma once

#include "daemon/app/instance.h"
#include "daemon/app/replay.h"
#include "daemon/record/recorder.h"

#include <tl/expected.hpp>

namespace tractiond {

struct Arguments {
  Places places;
  std::string inspected;     ///< not empty: this is a child process that evaluates the description of this camera
  std::string inspectedGel;  ///< not empty: this is a child process that checks this gel file
  bool limited = false;      ///< true: this is the child process of --plan
  std::string description;   ///< file of a camera's description for --plan; empty: none
  std::string images;        ///< file of raw pictures, "-": standard input; empty: a camera
  RecordOptions record;
  ReplayOptions replay;  ///< with an empty file nothing is replayed
  // true: does that, and exits.
  bool checkConfig = false, printConfig = false, listCameras = false;
};

/// Parses the command line; reads no file, and fills in no default places (located()). In place of arguments returns an
/// exit code: 0 after printing help, the version or a description for the manual pages to standard output, EX_USAGE
/// after printing an error to standard error.
tl::expected<Arguments, int> parseArguments(int argc, char** argv);

}  // namespace tractiond

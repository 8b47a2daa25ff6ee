// The command line.
#pragma once

#include "daemon/instance.h"
#include "daemon/recorder.h"
#include "daemon/replay.h"

#include <tl/expected.hpp>

namespace tractiond {

struct Arguments {
  Places places;
  std::string
      inspected;  ///< camera whose description is to be evaluated: this is a child of tractiond; empty: it is not
  bool limited = false;     ///< likewise, with --plan
  std::string description;  ///< of a camera, to say what would be done with it; empty: none
  std::string images;       ///< empty: a camera
  RecordOptions record;
  ReplayOptions replay;  ///< no file: nothing is replayed
  bool checkConfig = false, printConfig = false, listCameras = false;
};

/// Or an exit code: 0 when help or the version was asked for and printed, EX_USAGE for an error that was printed.
tl::expected<Arguments, int> parseArguments(int argc, char** argv);

}  // namespace tractiond

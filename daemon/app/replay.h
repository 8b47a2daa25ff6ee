// Passes a recording's pictures through the daemon's stages again.
#pragma once

#include "base/error.h"
#include "daemon/app/config.h"
#include "daemon/app/instance.h"

#include <tl/expected.hpp>

#include <string>

namespace tractiond {

struct ReplayOptions {
  std::string file;     ///< the recording
  double rate = 1.0;    ///< multiple of the original speed; 0: as fast as possible
  bool ownGel = false;  ///< true: gel, [track] and [solve] of the configuration; false: those of the recording
};

/// Replays a recording until it ends or a stop signal arrives: publishes at the instance's endpoints, and records if
/// the configuration states a file. Times in the messages are those of the recording. EX_NOINPUT: the recording cannot
/// be opened. EX_IOERR: it cannot be read to its end. EX_DATAERR: it is not a recording, has no pictures, or is damaged
/// or cut off; in the last case the pictures that could be read have been replayed. EX_PROTOCOL: it is of a newer
/// version. EX_CONFIG: it is of another sensor than the gel file's. Also errors of the gel file (loadSensor()), of the
/// solver (solve::makeSolver()), of the runtime directory (OwnDirectory::claim()), of the sockets
/// (publish::Publisher::open()) and of a new recording (Recorder). Blocks, and replaces the handlers of SIGINT and
/// SIGTERM; after either it succeeds.
/// \param config not completed()
/// \param places located()
tl::expected<void, Error> replay(const Config& config, const Places& places, const ReplayOptions& options);

}  // namespace tractiond

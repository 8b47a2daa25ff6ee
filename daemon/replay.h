// Computes a recording again: its pictures pass the same stages.
#pragma once

#include "base/error.h"
#include "daemon/config.h"
#include "daemon/instance.h"

#include <tl/expected.hpp>

#include <string>

namespace tractiond {

struct ReplayOptions {
  std::string file;
  double rate = 1.0;    ///< relative to the recorded speed; 0: as fast as possible
  bool ownGel = false;  ///< uses gel, [track] and [solve] of the configuration instead of the recording's
};

/// Publishes at the instance's endpoints, and records if configured, until the recording ends or a signal comes. All
/// times in the messages are those of the recording. Errors: EX_NOINPUT if it cannot be read; EX_DATAERR if it is no
/// recording, has no pictures, or is damaged (after its intact part was replayed); EX_PROTOCOL if its version is newer;
/// EX_CONFIG if it belongs to another sensor than the gel file's.
tl::expected<void, Error> replay(const Config& config, const Places& places, const ReplayOptions& options);

}  // namespace tractiond

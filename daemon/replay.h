// A recording's pictures through the same stages once more.
#pragma once

#include "base/error.h"
#include "daemon/config.h"
#include "daemon/instance.h"

#include <tl/expected.hpp>

#include <string>

namespace tractiond {

struct ReplayOptions {
  std::string file;
  double rate = 1.0;    ///< times as fast as it was; 0: as fast as possible
  bool ownGel = false;  ///< gel, [track] and [solve] are those of the configuration; else those of the recording
};

/// Publishes at the instance's endpoints, and records where the configuration says so, until the recording ends or a
/// signal comes. All times in the messages are those of the recording. EX_NOINPUT: it cannot be read; EX_DATAERR: it is
/// no recording, has no pictures, or is damaged (also after what is whole was replayed); EX_PROTOCOL: of a newer
/// version; EX_CONFIG: of another sensor than the gel file's.
tl::expected<void, Error> replay(const Config& config, const Places& places, const ReplayOptions& options);

}  // namespace tractiond

// One of several daemons on a machine: locates its files.
#pragma once

#include "base/error.h"
#include "base/service/own_directory.h"
#include "daemon/app/config.h"

#include <tl/expected.hpp>

#include <filesystem>
#include <string>

namespace tractiond {

/// Places of an instance's files. Empty: not given on the command line.
struct Places {
  std::string instance = "default";  ///< 1 to 24 of A-Z, a-z, 0-9, _ and -
  std::filesystem::path config = {}, state = {}, runtime = {};
};

/// Fills in what is not given: the configuration /etc/tractiond/NAME.toml if that exists; for the directories systemd's
/// $STATE_DIRECTORY and $RUNTIME_DIRECTORY, else for root /var/lib/tractiond/NAME and /run/tractiond/NAME, for other
/// users tractiond/NAME below $XDG_STATE_HOME (~/.local/state) and $XDG_RUNTIME_DIR (else /tmp/tractiond-UID/NAME).
/// Variables count if they are absolute paths. Makes the two directories absolute, by the working directory, and
/// creates none. The configuration stays empty if there is no file. EX_USAGE for an invalid name. Reentrant.
tl::expected<Places, Error> located(Places places);

/// Fills in the instance's own endpoints where the configuration leaves them empty: ipc sockets in its runtime
/// directory, and for the instance "default" also TCP on the loopback interface, except for control. An empty name of
/// the sensor becomes the instance's. Replaces kAdoptedGelFile by the gel file that is kept in the state directory, or
/// by kNoGelFile if there is none yet. Reentrant.
/// \param places located()
Config completed(Config config, const Places& places);

}  // namespace tractiond

// An instance, one of several daemons on a machine: its files and directories, which no other process uses.
#pragma once

#include "base/error.h"
#include "daemon/config.h"

#include <tl/expected.hpp>

#include <filesystem>
#include <string>

namespace tractiond {

/// Paths of the command line; empty: by the instance's name.
struct Places {
  std::string instance = "default";
  std::filesystem::path config = {}, state = {}, runtime = {};
};

/// Fills in what is not given: the configuration /etc/tractiond/NAME.toml if there is one; for the directories
/// systemd's $STATE_DIRECTORY and $RUNTIME_DIRECTORY, else for root /var/lib/tractiond/NAME and /run/tractiond/NAME,
/// for others tractiond/NAME below $XDG_STATE_HOME (~/.local/state) and $XDG_RUNTIME_DIR. EX_USAGE for an impossible
/// name.
tl::expected<Places, Error> located(Places places);

/// Fills in the instance's own endpoints and name where the configuration leaves them empty.
Config completed(Config config, const Places& places);

/// Those of a completed configuration's endpoints.
std::vector<std::filesystem::path> socketFiles(const Config& completed);

/// A directory that no other instance uses while this exists. The directory itself is locked, so that no lock file
/// remains.
class OwnDirectory {
 public:
  /// Creates and locks it. Fails with EX_TEMPFAIL if another process holds it, EX_CANTCREAT or EX_NOPERM if it cannot
  /// be created. \param what name for the error: "state directory"
  static tl::expected<OwnDirectory, Error> claim(const std::filesystem::path& path, const std::string& what);
  OwnDirectory(OwnDirectory&& other) noexcept;
  OwnDirectory& operator=(OwnDirectory&&) = delete;
  ~OwnDirectory();  ///< Removes it if it was created here and is empty.

 private:
  OwnDirectory(std::filesystem::path path, int descriptor, bool made);

  std::filesystem::path path_;
  int descriptor_;
  bool made_;
};

}  // namespace tractiond

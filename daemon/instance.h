// One of several daemons on a machine: where it keeps its things, and that nobody else has them.
#pragma once

#include "base/error.h"
#include "daemon/config.h"

#include <tl/expected.hpp>

#include <filesystem>
#include <string>

namespace tractiond {

/// What the command line says; empty: by the instance's name.
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

/// A directory that is ours alone while this lives: locked itself, so that no lock file can stay behind.
class OwnDirectory {
 public:
  /// Made if it is not there. EX_TEMPFAIL when another process holds it, EX_CANTCREAT or EX_NOPERM when it cannot be.
  /// \param what it is, for the error: "state directory"
  static tl::expected<OwnDirectory, Error> claim(const std::filesystem::path& path, const std::string& what);
  OwnDirectory(OwnDirectory&& other) noexcept;
  OwnDirectory& operator=(OwnDirectory&&) = delete;
  ~OwnDirectory();  ///< if it was made here and is empty, it goes

 private:
  OwnDirectory(std::filesystem::path path, int descriptor, bool made);

  std::filesystem::path path_;
  int descriptor_;
  bool made_;
};

}  // namespace tractiond

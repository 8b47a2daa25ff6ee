// One of several daemons on a machine: locates its files and keeps other processes from its directories.
#pragma once

#include "base/error.h"
#include "daemon/config.h"

#include <tl/expected.hpp>

#include <filesystem>
#include <string>

namespace tractiond {

/// Places of an instance's files. Empty: not given on the command line.
struct Places {
  std::string instance = "default";
  std::filesystem::path config = {}, state = {}, runtime = {};
};

/// Fills in what is not given: the configuration /etc/tractiond/NAME.toml if that exists; for the directories systemd's
/// $STATE_DIRECTORY and $RUNTIME_DIRECTORY, else for root /var/lib/tractiond/NAME and /run/tractiond/NAME, for other
/// users tractiond/NAME below $XDG_STATE_HOME (~/.local/state) and $XDG_RUNTIME_DIR. EX_USAGE for an invalid name.
tl::expected<Places, Error> located(Places places);

/// Fills in the instance's own endpoints and name where the configuration leaves them empty.
Config completed(Config config, const Places& places);

/// Returns the socket files of a completed configuration's endpoints.
std::vector<std::filesystem::path> socketFiles(const Config& completed);

/// A directory that this process holds exclusively. The directory itself is locked, so that no lock file stays behind.
class OwnDirectory {
 public:
  /// Locks the directory and creates it if it is missing. EX_TEMPFAIL: another process holds it. EX_CANTCREAT,
  /// EX_NOPERM: it cannot be created or opened. \param what name for the error: "state directory"
  static tl::expected<OwnDirectory, Error> claim(const std::filesystem::path& path, const std::string& what);
  OwnDirectory(OwnDirectory&& other) noexcept;
  OwnDirectory& operator=(OwnDirectory&&) = delete;
  ~OwnDirectory();  ///< Unlocks the directory; removes it if claim() created it and it is empty.

 private:
  OwnDirectory(std::filesystem::path path, int descriptor, bool made);

  std::filesystem::path path_;
  int descriptor_;
  bool made_;
};

}  // namespace tractiond

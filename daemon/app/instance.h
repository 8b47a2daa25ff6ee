// One of several daemons on a machine: locates its files and keeps other processes from its directories.
#pragma once

#include "base/error.h"
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
/// the sensor becomes the instance's. Reentrant. \param places located()
Config completed(Config config, const Places& places);

/// Returns the socket files of a completed configuration's ipc endpoints, whether they exist or not; abstract sockets
/// (ipc://@NAME) have none.
std::vector<std::filesystem::path> socketFiles(const Config& completed);

/// A directory that this process holds exclusively. The directory itself is locked, so that no lock file stays behind.
class OwnDirectory {
 public:
  /// Locks the directory and creates it, with its parents, if it is missing. Does not wait for the lock. EX_TEMPFAIL:
  /// another process holds it. EX_NOPERM: no permission to create, open or write it, or another user may control it:
  /// every user can write into it; or, below a directory like /tmp, it or its parent belongs to another user than this
  /// one and root. EX_CANTCREAT: it cannot be created or opened for another reason. \param what name for the error, of
  /// which the first word names the option that states it: "state directory"
  static tl::expected<OwnDirectory, Error> claim(const std::filesystem::path& path, const std::string& what);
  OwnDirectory(OwnDirectory&& other) noexcept;  ///< Takes over the lock; `other` holds none afterwards.
  OwnDirectory& operator=(OwnDirectory&&) = delete;
  /// Unlocks the directory; removes it if claim() created it and it is empty, but no parent. Does nothing after a move.
  ~OwnDirectory();

 private:
  OwnDirectory(std::filesystem::path path, int descriptor, bool made);

  std::filesystem::path path_;
  int descriptor_;
  bool made_;
};

}  // namespace tractiond

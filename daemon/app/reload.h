// Takes over what is new in a configuration while the instrument runs.
#pragma once

#include "base/error.h"
#include "daemon/app/config.h"
#include "daemon/records/marker_field.h"

#include <tl/expected.hpp>

#include <string>
#include <vector>

namespace tractiond {

/// What a reload has read.
struct Reread {
  Config config;     ///< completed()
  Id calibration{};  ///< solve::calibrationId() of what its gel file holds; all zero without a gel
};

/// Returns a completed configuration with the id of what its gel file holds, which it reads. May wait for a disk.
/// EX_NOINPUT: a file cannot be read. EX_DATAERR: the influence file is damaged. EX_CONFIG: the gel file is wrong.
/// Reentrant.
tl::expected<Reread, Error> reread(Config completed);

/// The camera of a Reloader, for its thread.
class ReloadedCamera {
 public:
  virtual bool hasRefused() const = 0;  ///< Returns Camera::refusedLast().
  virtual void reopen() = 0;            ///< Opens the camera anew, with the options in force.

 protected:
  ~ReloadedCamera() = default;
};

/// Applies the changes of a configuration, or none of them if one needs a restart. If the camera refuses its changes,
/// that is logged and the camera is opened as before. Thread-bound.
class Reloader {
 public:
  /// \param inForce     configuration that is changed; outlives this
  /// \param calibration Reread::calibration of the gel in force
  /// \param camera      outlives this
  Reloader(Config& inForce, const Id& calibration, ReloadedCamera& camera)
      : inForce_(inForce)
      , calibration_(calibration)
      , camera_(camera) {}

  /// Applies what was read: sets the level of the log, and reopens the camera if its keys have changed, or if it
  /// refused the last change. Fails with EX_CONFIG, and applies nothing, if a key that is not Key::live has changed,
  /// the contents of the gel file, or, with pictures from a file, a key of the camera: they need a restart. \return the
  /// changes, a line each: "camera.gain = 2 (was 1)", and a line if the camera only tries again what it refused; empty:
  /// there are none
  tl::expected<std::vector<std::string>, Error> apply(const Reread& read);

  /// Applies what was read, and logs the result, an error too.
  void takeOver(const tl::expected<Reread, Error>& read);

 private:
  Config& inForce_;
  const Id calibration_;
  ReloadedCamera& camera_;
};

}  // namespace tractiond

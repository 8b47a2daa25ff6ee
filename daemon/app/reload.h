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

/// What a reload changes.
struct News {
  std::vector<std::string> lines;  ///< "camera.gain = 2 (was 1)"; empty: nothing
  bool isOfCamera = false;         ///< the camera is to be opened anew, with the configuration in force
};

/// Applies the changes of a configuration, or none of them if one needs a restart: sets the level of the log and the
/// camera's options in force. The camera is also opened anew if it refused the last change. Fails with EX_CONFIG, and
/// applies nothing, if a key that is not Key::live has changed, the contents of the gel file, or, with pictures from a
/// file, a key of the camera.
/// \param inForce          configuration that is changed
/// \param calibration      Reread::calibration of the gel in force
/// \param hasCameraRefused Camera::refusedLast()
tl::expected<News, Error> apply(const Reread& read, Config& inForce, const Id& calibration, bool hasCameraRefused);

/// Does the same, and logs the result, an error too. Returns News::isOfCamera.
bool takeOver(const tl::expected<Reread, Error>& read, Config& inForce, const Id& calibration, bool hasCameraRefused);

}  // namespace tractiond

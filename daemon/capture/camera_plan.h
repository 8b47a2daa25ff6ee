// Predicts from a camera's description alone how the camera would be set: a simulated device opens the file.
#pragma once

#include "base/error.h"
#include "daemon/capture/camera_options.h"

#include <tl/expected.hpp>

#include <string>
#include <vector>

namespace tractiond::capture {

struct CameraPlan {
  std::string vendor, model;
  std::vector<std::string> settings;  ///< to be made, as "Name = value"
  std::string format;                 ///< requested; empty: the camera's own, or the first of `formats` that it has
  std::vector<std::string> formats;   ///< in the file, and readable; best first
  std::string rate, exposure, gain, trigger, clock, chunks, link;  ///< the features that would be used, or "none"
  std::vector<std::string> notes;
};

/// Plans the settings of a camera. A file describes a family of cameras: a model may lack some of the formats and
/// triggers in it. Names, kinds and refusals are those of the file; numbers are not: registers hold zeros, and those
/// that state abilities hold ones. Errors: EX_NOINPUT, EX_DATAERR if the file cannot be opened; EX_CONFIG with what the
/// camera would refuse.
tl::expected<CameraPlan, Error> planCamera(const std::string& file, const CameraOptions& options);

}  // namespace tractiond::capture

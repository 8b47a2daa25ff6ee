// What would be done with a camera, by its description alone: the file is opened in a device without a camera.
#pragma once

#include "base/error.h"
#include "daemon/capture/camera_options.h"

#include <tl/expected.hpp>

#include <string>
#include <vector>

namespace tractiond::capture {

struct CameraPlan {
  std::string vendor, model;
  std::vector<std::string> settings;  ///< that would be made, as "Name = value"
  std::string format;                 ///< that is asked for; empty: the camera's own, or the first of these that it has
  std::vector<std::string> formats;   ///< that the file names and that can be read, the best first
  std::string rate, exposure, gain, trigger, clock, chunks, link;  ///< the features that would be used, or "none"
  std::vector<std::string> notes;
};

/// A file describes a family of cameras: formats and triggers are all that it names, and one model may have fewer.
/// Names, kinds and refusals are the file's; numbers are not: registers hold zeros, and what tells of abilities holds
/// ones. EX_NOINPUT, EX_DATAERR: the file is none that can be opened; EX_CONFIG: what the camera would refuse.
tl::expected<CameraPlan, Error> planCamera(const std::string& file, const CameraOptions& options);

}  // namespace tractiond::capture

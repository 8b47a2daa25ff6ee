// Shows what would be set on a camera, from the file of its description (GenICam XML) alone, without the camera.
#pragma once

#include "base/error.h"
#include "daemon/capture/camera_options.h"

#include <tl/expected.hpp>

#include <string>
#include <vector>

namespace tractiond::capture {

struct CameraPlan {
  std::string vendor, model;          ///< by the file
  std::vector<std::string> settings;  ///< settings that would be made, as "Name = value"
  std::string format;                 ///< format that is asked for; empty: the camera's own, or the first of `formats`
  std::vector<std::string> formats;   ///< formats that the file names and this program can read, best first
  std::string rate, exposure, gain, trigger, clock, chunks, link;  ///< the features that would be used, or "none"
  std::vector<std::string> notes;                                  ///< warnings, one sentence each
};

/// Makes the settings of `options` on a device without a camera, and returns them. A file describes a family of
/// cameras: one model may have fewer formats and triggers than it names. Names, kinds and refusals are the file's;
/// numbers that are read are not the camera's, as registers begin as makePaperDevice() sets them. EX_NOINPUT: the file
/// cannot be opened. EX_DATAERR: it is not a description. EX_CONFIG: the camera would refuse a
/// setting, or the file names no format that this program can read. Turns off GLib's log of XML in this process. A
/// damaged description can crash this process: tractiond calls it in a child.
tl::expected<CameraPlan, Error> planCamera(const std::string& file, const CameraOptions& options);

}  // namespace tractiond::capture

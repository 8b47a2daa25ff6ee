// Delivers raw pictures from a pipe or a file as a camera does: output of ffmpeg, GStreamer or a v4l2 tool, one picture
// directly after another.
#pragma once

#include "daemon/capture/camera_options.h"
#include "daemon/capture/driver.h"

namespace tractiond::capture {

/// Returns a function that opens a driver for the file CameraOptions::images, of pictures of the configured size and
/// format; `frameRate_Hz` is an upper limit, 0: as fast as they are taken. It fails with EX_CONFIG if size or format
/// are missing or the format is not known, and with EX_NOINPUT if the file cannot be opened. It does not wait: while a
/// named pipe has no writer yet, pop() returns kNothing. Ids count from 1. The time stamp is 0, as it is not known; a
/// picture arrives when it is whole and its time has come. While all buffers are out, nothing is read and pop() returns
/// kNothing. Driver::end() is EX_OK if the file ends after a whole picture, EX_DATAERR if within one or before the
/// first, EX_IOERR if it cannot be read.
OpenDriver fromPipe(const CameraOptions& options);

}  // namespace tractiond::capture

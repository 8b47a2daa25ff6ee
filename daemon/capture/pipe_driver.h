// A driver of raw pictures from a pipe or a file, as ffmpeg, GStreamer or a v4l2 tool writes them: one picture after
// another, with nothing between them.
#pragma once

#include "daemon/capture/driver.h"

#include <string>

namespace tractiond::capture {

struct PipeOptions {
  std::string path = "-";     ///< "-": standard input
  std::string format;         ///< a name of records/pixel_format.h
  int width = 0, height = 0;  ///< px
  int buffers = 10;
  double frameRate_Hz = 0.0;  ///< highest rate; 0: as fast as they are popped
};

/// Returns the driver. Errors: EX_CONFIG if size or format are missing; EX_NOINPUT if the file cannot be opened. Counts
/// the pictures from 1, and dates each with the host's time when it is complete and due. The file's end is EX_DATAERR
/// within a picture or before the first one, and else EX_OK.
OpenDriver fromPipe(const PipeOptions& options);

}  // namespace tractiond::capture

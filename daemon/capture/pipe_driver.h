// Delivers raw pictures from a pipe or a file as a camera does: output of ffmpeg, GStreamer or a v4l2 tool, one picture
// directly after another.
#pragma once

#include "daemon/capture/driver.h"

#include <string>

namespace tractiond::capture {

struct PipeOptions {
  std::string path = "-";     ///< "-": standard input
  std::string format;         ///< a name of records/pixel_format.h
  int width = 0, height = 0;  ///< px
  int buffers = 10;           ///< number of pictures that may be out at once, at least 1
  double frameRate_Hz = 0.0;  ///< upper limit; 0: as fast as they are taken
};

/// Returns a function that opens a driver for the file. It fails with EX_CONFIG if size or format are missing or the
/// format is not known, and with EX_NOINPUT if the file cannot be opened. It does not wait: while a named pipe has
/// no writer yet, pop() returns kNothing. Ids count from 1. The time stamp is 0, as it is not known; a picture
/// arrives when it is whole and its time has come. While all buffers are out, nothing is read and pop() returns
/// kNothing. Driver::end() is EX_OK if the file ends after a whole picture, EX_DATAERR if within one or before the
/// first, EX_IOERR if it cannot be read.
OpenDriver fromPipe(const PipeOptions& options);

}  // namespace tractiond::capture

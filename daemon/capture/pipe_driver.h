// Raw pictures from a pipe or a file as a camera: whatever ffmpeg, GStreamer or a v4l2 tool writes, one picture after
// another without anything between them.
#pragma once

#include "daemon/capture/driver.h"

#include <string>

namespace tractiond::capture {

struct PipeOptions {
  std::string path = "-";     ///< "-": standard input
  std::string format;         ///< a name of records/pixel_format.h
  int width = 0, height = 0;  ///< px
  int buffers = 10;
  double frameRate_Hz = 0.0;  ///< at most; 0: as fast as they are taken
};

/// EX_CONFIG: size or format are missing; EX_NOINPUT: the file cannot be opened. The pictures are counted from 1, and
/// dated by the host when they are whole and their time has come. An end within a picture, or before the first, is
/// EX_DATAERR, one between two is EX_OK.
OpenDriver fromPipe(const PipeOptions& options);

}  // namespace tractiond::capture

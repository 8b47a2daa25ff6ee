// Where the pictures of a film go, each with its true state: through the camera, or into a file.
#pragma once

#include "twin/failure.h"
#include "twin/film.h"
#include "twin/options.h"
#include "twin/truth_writer.h"

#include <tl/expected.hpp>

#include <atomic>

namespace twin {

/// Serves pictures at the camera's pace to the client that controls the camera, until `isStopping` or the end of
/// `options.seconds`, and blocks until then. Prints a line "ready ..." to standard output once clients can connect.
/// Errors: those of GvCamera::open(). Records of `truth` are written for the pictures that were sent. \param options
/// whose address, lostRatio and seconds are used: format and rate are the scenario's
tl::expected<void, Failure> serve(const Options& options, const Scenario& scenario, Film& film, TruthWriter& truth,
                                  const std::atomic<bool>& isStopping);

/// Writes pictures as fast as they are read. Their ids count from 1, as the daemon counts them. They have only scenario
/// times; other times in `truth` are 0. Blocks until `isStopping` or the end of `options.seconds`, in scenario time.
/// Errors: those of PictureWriter. SIGPIPE must be ignored.
tl::expected<void, Failure> writePictures(const Options& options, const Scenario& scenario, Film& film,
                                          TruthWriter& truth, const std::atomic<bool>& isStopping);

}  // namespace twin

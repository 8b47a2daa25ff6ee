// Where the pictures of a film go, each with its true state: through cameras, or into a file.
#pragma once

#include "twin/film.h"
#include "twin/options.h"
#include "twin/truth_writer.h"

#include <atomic>

namespace twin {

/// Serves pictures at the camera's pace to the client that controls the camera, until `isStopping` or the end of
/// `options.seconds`, and blocks until then. Prints a line "ready ..." to standard output once clients can connect.
/// Errors: those of GvCamera::open(). Records of `truth` are written for the pictures that were sent.
/// \param options whose address, lostRatio and seconds are used: format and rate are the scenario's
tl::expected<void, tractiond::Error> serve(const Options& options, const Scenario& scenario, Film& film,
                                           TruthWriter& truth, const std::atomic<bool>& isStopping);

/// Serves the pictures of both fingers, at `options.address` and `options.secondAddress`, and obeys the commands that
/// come to `options.commands`: text of two numbers, opening and height of the gripper [m]. The world stands still until
/// both cameras have clients. With `options.lockstep`, from the first command on each pair of pictures waits for one
/// command, and then takes the oldest that was not used. Blocks until `isStopping` or the end of `options.seconds`.
/// Errors: those of GvCamera::open(); EX_UNAVAILABLE or EX_USAGE if the endpoint cannot be bound.
tl::expected<void, tractiond::Error> serveHand(const Options& options, const Scenario& scenario, HandFilm& film,
                                               TruthWriter& truth, const std::atomic<bool>& isStopping);

/// Writes pictures into a file or a pipe, one after another without separators, as fast as they are read: the input of
/// `tractiond --images`. Their ids count from 1, as the daemon counts them. They have only scenario times; other times
/// in `truth` are 0. Blocks until `isStopping` or the end of `options.seconds`, in scenario time. SIGPIPE must be
/// ignored. Errors: EX_CANTCREAT, EX_IOERR, also if the reader has closed the pipe.
tl::expected<void, tractiond::Error> writePictures(const Options& options, const Scenario& scenario, Film& film,
                                                   TruthWriter& truth, const std::atomic<bool>& isStopping);

}  // namespace twin

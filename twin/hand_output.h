// The hand as a controller meets it: two cameras to look through, and an endpoint that takes commands.
#pragma once

#include "twin/hand_film.h"
#include "twin/options.h"

#include <atomic>

namespace twin {

/// Serves the pictures of both fingers, at `options.address` and `options.secondAddress`, and obeys the commands that
/// come to `options.commands`: text of two numbers, opening and height of the gripper [m]. The world stands still until
/// both cameras have clients. With `options.lockstep`, from the first command on each pair of pictures waits for one
/// command, and then takes the oldest that was not used. Blocks until `isStopping` or the end of `options.seconds`.
/// Errors: those of GvCamera::open(); EX_UNAVAILABLE or EX_USAGE if the endpoint cannot be bound.
tl::expected<void, Failure> serveHand(const Options& options, const Scenario& scenario, HandFilm& film,
                                      TruthWriter& truth, const std::atomic<bool>& isStopping);

}  // namespace twin

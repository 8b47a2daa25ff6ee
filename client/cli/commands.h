// Commands of tractionctl. They block until they are done. All throw traction::Error, and OutputError if standard
// output cannot be written. Where a comment says "on a signal", it is SIGINT, SIGTERM or SIGHUP, whose handlers the
// command sets.
#pragma once

#include "traction/control.h"
#include "traction/subscriber.h"

#include <limits>
#include <stdexcept>

namespace traction::cli {

/// Duration of a command that ends on a signal only [s].
constexpr double kForever = std::numeric_limits<double>::infinity();

/// Runs the live view; if standard output is not a terminal, prints one line per second. Returns after `seconds`, on a
/// signal, or when the key q is pressed in the live view. Receives fields, descriptions and the status, whatever
/// `options.topics` is. \param seconds kForever: no limit
/// \throws Error kNoAnswer if no publisher was found for 3 s
void watch(const SubscriberOptions& options, double seconds);

/// Prints `count` messages of the chosen topics as JSON lines (negative: until a signal). Reports lost messages on
/// standard error, when they are noticed and at the end. \param topics or-ed Topics, instead of `options.topics`
void echo(const SubscriberOptions& options, unsigned topics, long count);

/// The daemon runs but cannot publish fields: it has no camera or no gel file.
class NoField : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Prints the status, as text or as JSON. \throws NoField after printing it, if no field can be published
void status(const ControlOptions& options, bool json);
/// Writes the next picture as a PNG file, which is replaced if it exists. \param marked true: draws the markers and
/// spots found \throws OutputError if the file cannot be written
void snapshot(const ControlOptions& options, const std::string& path, bool marked);
/// Prints the description as JSON.
void describe(const ControlOptions& options);
/// `anyway`: takes the zero even if something seems to touch the gel. `undo`: restores the previous zero instead.
struct ZeroCommand {
  bool anyway = false, undo = false, json = false;
};
/// Takes or restores a zero and prints the result, as text or as JSON.
void zero(const ControlOptions& options, const ZeroCommand& command);

}  // namespace traction::cli

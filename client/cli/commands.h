// Commands of tractionctl. They block until they are done. All throw traction::Error, and OutputError if standard
// output cannot be written. What zero() and watch() print last may remain in the buffer of stdio until flushOutput().
// Where a comment says "on a signal", it is SIGINT, SIGTERM or SIGHUP, whose handlers the command sets.
#pragma once

#include "traction/control.h"
#include "traction/subscriber.h"

#include <limits>
#include <stdexcept>

namespace traction::cli {

/// Duration of a command that ends on a signal only [s].
constexpr double kForever = std::numeric_limits<double>::infinity();

/// Runs the live view; unless isTerminal(), prints summary() once per second instead, and at once when the
/// reason why there is no field changes. Returns after `seconds`, on a signal, or when the key q is pressed in the live
/// view. Receives fields, descriptions and the status, whatever `options.topics` is. \param seconds kForever: no limit
/// \throws Error kNoAnswer if no publisher is found in the first 3 s; later it waits for the daemon's return
void watch(const SubscriberOptions& options, double seconds);

/// Prints messages of the chosen topics as JSON lines. Returns after `count` messages (negative: no limit), or on a
/// signal. Reports on standard error what Notes reports, and the messages lost in all at the end. \param topics or-ed
/// Topics, instead of `options.topics` \throws Error kNoAnswer if no publisher is found in the first 3 s
void echo(const SubscriberOptions& options, unsigned topics, long count);

/// Prints a line for each contact that begins or ends, and one per second for each that lasts. Starts a traction-touch
/// for the instance if none answers within half a second and `options.endpoint` is empty, and ends it. Returns after
/// `seconds`, or on a signal. Reports on standard error what Notes reports. \throws Error kNoAnswer if no publisher is
/// found in the first 3 s, or none can be started
void touch(const SubscriberOptions& options, double seconds);

/// The daemon runs but cannot publish fields: it has no camera or no gel file.
class NoField : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Prints the status, as text or as one line of JSON. \throws NoField after printing it, if no field can be published
void status(const ControlOptions& options, bool json);
/// Writes the camera's next picture as a PNG file, which is replaced if it exists, and prints one line about it. \param
/// marked true: draws the markers on it, or the spots found if no markers are labelled yet \throws OutputError also if
/// the file cannot be written
void snapshot(const ControlOptions& options, const std::string& path, bool marked);
/// Prints the description as one line of JSON.
void describe(const ControlOptions& options);
/// `anyway`: takes the zero even if something seems to touch the gel. `undo`: restores the previous zero instead, and
/// `anyway` has no effect.
struct ZeroCommand {
  bool anyway = false, undo = false, json = false;
};
/// Takes or restores a zero and prints the result with its remark, as text or as one line of JSON.
void zero(const ControlOptions& options, const ZeroCommand& command);

}  // namespace traction::cli

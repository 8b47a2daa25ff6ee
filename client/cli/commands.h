// What tractionctl does. All throw traction::Error and, where they print without an end, OutputError.
#pragma once

#include "traction/control.h"
#include "traction/subscriber.h"

#include <limits>
#include <stdexcept>

namespace traction::cli {

constexpr double kForever = std::numeric_limits<double>::infinity();

/// The live view; one line a second where standard output is no terminal.
void watch(const SubscriberOptions& options, double seconds);

/// Messages as JSON lines: `count` (negative: until a signal comes) of the chosen topics. What was lost is said on
/// standard error, when it is noticed and at the end.
void echo(const SubscriberOptions& options, unsigned topics, long count);

/// The daemon is there, and no field can come: its camera is not there, or there is no gel.
class NoField : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Prints the status. \throws NoField after it was printed
void status(const ControlOptions& options, bool json);
/// The next picture as a PNG file; `marked`: with what was found in it.
void snapshot(const ControlOptions& options, const std::string& path, bool marked);
void describe(const ControlOptions& options);
struct ZeroCommand {
  bool anyway = false, undo = false, json = false;
};
void zero(const ControlOptions& options, const ZeroCommand& command);

}  // namespace traction::cli

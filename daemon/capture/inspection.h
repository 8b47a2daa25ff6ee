// Evaluates a camera's description (its GenICam XML) in a child process before this process opens the camera: the
// description may crash what evaluates it.
#pragma once

#include "daemon/capture/child.h"

#include <string>
#include <string_view>

namespace tractiond::capture {

struct Inspection {
  enum class Outcome {
    kHarmless,    ///< `text` is hashOf() the description
    kFault,       ///< `text` is a sentence that states the fault
    kUnreadable,  ///< the camera answers, but does not open; `text` is a sentence that states why, and what to do
    kAbsent,      ///< the camera does not answer; `text` states what Aravis said
  };
  Outcome outcome = Outcome::kFault;
  std::string text;
};

/// Opens the camera, evaluates its description and all its features without the camera, and prints the result as
/// encodeInspection() returns it, to standard output. For the child process: lowers its limits for good, see
/// limitChild(). Returns EX_OK, whatever the outcome; a harmful description may end the process instead. \param id as
/// Aravis takes it
int printInspection(const std::string& id);

/// Lets a child process (`options.program --inspect ID`) run printInspection(), and returns its result; kFault if the
/// child does not start, is killed by the limits of `options` or by a stop, ends by a signal, or prints nonsense.
/// Blocks until the child has ended. Reentrant. \param id as Aravis takes it
Inspection inspectInChild(const std::string& id, const ChildOptions& options, const std::stop_token& stop = {});

/// Returns the line that the child prints, for decodeInspection(): the outcome in a word, the text, and a line feed.
std::string encodeInspection(const Inspection& inspection);

/// Decodes a line of encodeInspection(). Accepts any bytes, as the description may have taken over the child: returns
/// kFault with a fixed sentence if they are malformed, which includes kHarmless without a hash. Cuts the text to 500
/// characters, and replaces each that is not printable ASCII by '?'.
Inspection decodeInspection(std::string_view bytes);

/// Returns the SHA-256 of a description's text, as 64 hexadecimal digits.
std::string hashOf(std::string_view xml);

}  // namespace tractiond::capture

// Evaluates a camera's description in a child process before this process opens the camera: the description may crash
// what evaluates it.
#pragma once

#include "daemon/capture/child.h"

#include <string>
#include <string_view>

namespace tractiond::capture {

struct Inspection {
  enum class Outcome {
    kHarmless,  ///< `text` is hashOf() the description
    kFault,     ///< `text` is a sentence that states the fault
    kAbsent,    ///< `text` states why the camera cannot be opened
  };
  Outcome outcome = Outcome::kFault;
  std::string text;
};

/// Opens the camera, evaluates its description and all its features without the camera, and prints the result as
/// encodeInspection() returns it. For the child process: lowers its limits. Returns an exit code.
/// \param id as Aravis takes it, or "*" for the first camera
int printInspection(const std::string& id);

/// Lets a child process run printInspection(), and returns its result; kFault if the child ends otherwise. Blocks until
/// the child has ended, or a stop was requested. Reentrant. \param id as Aravis takes it; empty: the first camera
Inspection inspectApart(const std::string& id, const ChildOptions& options, const std::stop_token& stop = {});

/// Returns the line that the child prints.
std::string encodeInspection(const Inspection& inspection);

/// Decodes a line of encodeInspection(). Accepts any bytes, as the description may have taken over the child: returns
/// kFault with a fixed sentence if they are malformed. Cuts the text to 500 characters, and replaces each that is not
/// printable ASCII by '?'.
Inspection decodeInspection(std::string_view bytes);

/// Returns the SHA-256 of a description's text, as 64 hexadecimal digits.
std::string hashOf(std::string_view xml);

}  // namespace tractiond::capture

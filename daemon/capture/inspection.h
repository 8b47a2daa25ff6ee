// Evaluates a camera's description (its GenICam XML) in a child process before this process opens the camera: the
// description may crash what evaluates it.
#pragma once

#include "daemon/capture/child.h"

#include <string>
#include <string_view>

namespace tractiond::capture {

struct Inspection {
  enum class Outcome {  // as the child's exit code
    kHarmless,          ///< `text` is hashOf() the description
    kFault,             ///< `text` is a sentence that states the fault
    kUnreadable,        ///< the camera answers, but does not open; `text` is a sentence that states why, and what to do
    kAbsent,            ///< the camera does not answer; `text` states what Aravis said
  };
  Outcome outcome = Outcome::kFault;
  std::string text;
};

/// Opens the camera, evaluates its description and all its features without the camera, and prints Inspection::text to
/// standard output. For the child process: lowers its limits for good, see limitChild(). Returns the outcome as a
/// number; a harmful description may end the process instead. \param id as Aravis takes it
int printInspection(const std::string& id);

/// Lets a child process (`options.program --inspect ID`) run printInspection(), and returns its result; kFault if the
/// child does not start, is killed by the limits of `options` or by a stop, ends by a signal, or says nothing. The text
/// has at most 500 characters, all of them printable ASCII, as the description may have taken over the child. Blocks
/// until the child has ended. Reentrant. \param id as Aravis takes it
Inspection inspectInChild(const std::string& id, const ChildOptions& options, const std::stop_token& stop = {});

/// Returns the SHA-256 of a description's text, as 64 hexadecimal digits.
std::string hashOf(std::string_view xml);

}  // namespace tractiond::capture

// Evaluates a camera's description (its GenICam XML) in a child process before this process opens the camera: the
// description may crash what evaluates it.
#pragma once

#include "base/child.h"

#include <string>

namespace tractiond::capture {

struct Inspection {
  enum class Outcome {  // as the child's exit code
    kHarmless,
    kFault,       ///< `text` is a sentence that states the fault
    kUnreadable,  ///< the camera answers, but does not open; `text` is a sentence that states why, and what to do
    kAbsent,      ///< the camera does not answer; `text` states what Aravis said
  };
  Outcome outcome = Outcome::kFault;
  std::string text;
};

/// Limits this process for good: 1 GiB of address space beyond the present size, 5 s of processor time, no core dump,
/// no writing to files (pipes are none); the kernel ends the process when its parent ends. Limits that are lower
/// already stay. A child that evaluates a description must call it first.
void limitChild();

/// Returns why such a child gave no answer, as the end of a sentence: "crashes what evaluates it (signal 11)"; empty
/// for How::kExit.
std::string misdeed(const ChildEnd& end);

/// Opens the camera, evaluates its description and all its features without the camera, and prints Inspection::text to
/// standard output. For the child process: lowers its limits for good, see limitChild(). Returns the outcome as a
/// number; a harmful description may end the process instead.
/// \param id as Aravis takes it
int printInspection(const std::string& id);

/// Lets a child process (`options.program --inspect ID`) run printInspection(), and returns its result; kFault if the
/// child does not start, is killed by the limits of `options` or by a stop, ends by a signal, or says nothing. The text
/// has at most 500 characters, all of them printable ASCII, as the description may have taken over the child. Blocks
/// until the child has ended. Reentrant.
/// \param id as Aravis takes it
Inspection inspectInChild(const std::string& id, const ChildOptions& options, const std::stop_token& stop = {});

}  // namespace tractiond::capture

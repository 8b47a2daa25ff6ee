// Finds out why Aravis cannot read the description (GenICam XML) of a network camera that is there. Internal to this
// folder.
#pragma once

#include <string>

namespace tractiond::capture {

/// Returns why the camera at an IPv4 address does not open, although it answers, and what to do, as one sentence: it
/// refuses to be read, states no place of its description, or one outside of it, or what is there is no description.
/// Empty: it does not answer. Reads by the control protocol alone, as Aravis does not say. Blocks for seconds.
std::string whyUnreadable(const std::string& address);

/// The same, only if the camera claims a description larger than any camera's: must be asked before Aravis opens the
/// camera, as that allocates any size. What else Aravis makes of a place is left to it.
std::string whyTooLarge(const std::string& address);

}  // namespace tractiond::capture

// Finds the instances of tractiond on this machine.
#pragma once

#include <set>
#include <string>

namespace traction::cli {

/// Returns the instances with a control socket in a runtime directory and those with a configuration file. If there are
/// none, returns the default instance, which may use TCP. Never empty.
std::set<std::string> instancesHere();

}  // namespace traction::cli

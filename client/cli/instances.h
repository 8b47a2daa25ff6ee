// Finds the instances of tractiond on this machine.
#pragma once

#include <set>
#include <string>

namespace traction::client {

/// Returns the names of the instances with a control socket in a runtime directory and of those with a configuration
/// file /etc/tractiond/NAME.toml. Directories that cannot be read count as empty. If there are none, returns "default",
/// which may use TCP. Never empty.
std::set<std::string> instancesHere();

}  // namespace traction::client

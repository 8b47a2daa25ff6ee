// Which instances of tractiond this machine has.
#pragma once

#include <set>
#include <string>

namespace traction::cli {

/// Those with a runtime directory of which a daemon has made sockets, and those with a configuration, which are down
/// without one; else the default one, which may be on TCP. Never empty.
std::set<std::string> instancesHere();

}  // namespace traction::cli

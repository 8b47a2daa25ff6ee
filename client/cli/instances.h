// Finds the instances of tractiond on this machine, and counts their subscribers.
#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>

namespace traction::client {

/// Returns the names of the instances with a control socket in a runtime directory and of those with a configuration
/// file /etc/tractiond/NAME.toml. Directories that cannot be read count as empty. If there are none, returns "default",
/// which may use TCP. Never empty.
std::set<std::string> instancesHere();

/// Returns the number of connections to a local endpoint (ipc:///PATH or tcp://127.0.0.1:PORT), those of this process
/// included, from the kernel's socket tables. Returns nothing for any other endpoint, or if the table cannot be read.
/// \param tables directory of the tables unix and tcp
std::optional<int> subscribersOf(const std::string& endpoint, const std::filesystem::path& tables = "/proc/net");

}  // namespace traction::client

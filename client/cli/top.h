// tractionctl top: shows the state of instruments live.
#pragma once

#include "traction/subscriber.h"

#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace traction::cli {

struct TopCommand {
  std::vector<std::string> endpoints;  ///< endpoints or names of local instances; empty: see top()
  double seconds = std::numeric_limits<double>::infinity();  ///< duration; infinity: no limit
  bool once = false;                                         ///< prints all figures once they have arrived, and ends
};

/// On a terminal, draws a page until q or a signal (SIGINT, SIGTERM or SIGHUP, whose handlers it sets); otherwise
/// prints one line per instrument and second. \param options for each subscription \param one true: only the instance
/// of `options`; false: all instances of this machine if no endpoints are given \throws Error kNoAnswer if there is no
/// publisher at any endpoint for 3 s; OutputError
void top(const SubscriberOptions& options, const TopCommand& command, bool one);

/// Returns the number of connections to a local endpoint, from the kernel's socket tables. Returns nothing if the
/// endpoint is not local or the number is not known.
std::optional<int> subscribersOf(const std::string& endpoint, const std::filesystem::path& tables = "/proc/net");

}  // namespace traction::cli

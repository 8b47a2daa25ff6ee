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
  bool once = false;  ///< prints all figures when they have arrived, or after 3 s, and ends
};

/// If isTerminal(), draws a page until q is pressed; otherwise prints one line per instrument and second. Returns also
/// after `command.seconds` and on SIGINT, SIGTERM or SIGHUP, whose handlers it sets. An instrument that can no longer
/// be received is shown with the reason. \param options for each subscription, except topics \param one without effect
/// if endpoints are given; true: only the instance or endpoint of `options`; false: all instances of this machine
/// \throws Error kNoAnswer if there is no publisher at any endpoint in the first 3 s, kBadEndpoint, kBadKeys;
/// OutputError
void top(const SubscriberOptions& options, const TopCommand& command, bool one);

/// Returns the number of connections to a local endpoint (ipc:///PATH or tcp://127.0.0.1:PORT), those of this process
/// included, from the kernel's socket tables. Returns nothing for any other endpoint, or if the table cannot be read.
/// \param tables directory of the tables unix and tcp
std::optional<int> subscribersOf(const std::string& endpoint, const std::filesystem::path& tables = "/proc/net");

}  // namespace traction::cli

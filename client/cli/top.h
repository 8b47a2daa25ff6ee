// tractionctl top: how instruments do, live.
#pragma once

#include "traction/subscriber.h"

#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace traction::cli {

struct TopCommand {
  std::vector<std::string> endpoints;  ///< or names of instances of this machine; empty: see top()
  double seconds = std::numeric_limits<double>::infinity();
  bool once = false;  ///< print all numbers when they are there, and end
};

/// On a terminal a page until q or a signal; else a line an instrument a second. \param options of each subscription
/// \param one of `options` alone; else all instances of this machine, where no endpoints are named
/// \throws Error kNoAnswer: nobody is at any of the endpoints; OutputError
void top(const SubscriberOptions& options, const TopCommand& command, bool one);

/// Connections to a local endpoint by the kernel's tables of sockets. None: it is not of this machine, or not known.
std::optional<int> subscribersOf(const std::string& endpoint, const std::filesystem::path& tables = "/proc/net");

}  // namespace traction::cli

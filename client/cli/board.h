// How instruments do, as tractionctl top shows it: all numbers of one, or the main ones of several below each other.
#pragma once

#include "client/cli/canvas.h"
#include "client/cli/scene.h"

#include <optional>
#include <string>
#include <vector>

namespace traction::cli {

struct Watched {
  std::string name;      ///< as it was asked for
  std::string endpoint;  ///< empty: its name says it all
  Scene scene;
  std::string failure;             ///< why nothing more can be received; empty: it can
  std::optional<int> subscribers;  ///< on this machine, at the endpoint; none: not known
};

/// A page of the given size. Numbers that are not of now stand in brackets, and why is said.
Canvas drawBoard(const std::vector<Watched>& all, int width, int height, std::int64_t now_ns);

/// One instrument in one line: for a log.
std::string boardLine(const Watched& one, std::int64_t now_ns);

/// All numbers of one instrument, a line each.
std::string boardText(const Watched& one, std::int64_t now_ns);

}  // namespace traction::cli

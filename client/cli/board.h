// Draws the state of instruments for tractionctl top: all figures of one, or the main figures of several.
#pragma once

#include "client/cli/canvas.h"
#include "client/cli/scene.h"

#include <optional>
#include <string>
#include <vector>

namespace traction::cli {

/// An instrument that is shown.
struct Watched {
  std::string name;      ///< as requested: an endpoint, or the name of an instance
  std::string endpoint;  ///< empty: the name identifies it
  Scene scene;
  std::string failure;             ///< why nothing more can be received; empty: it can
  std::optional<int> subscribers;  ///< connections to its endpoint on this machine; empty: not known
};

/// Draws a page of width x height characters. Figures that are out of date are in brackets, with the reason. \param
/// now_ns CLOCK_MONOTONIC
Canvas drawBoard(const std::vector<Watched>& all, int width, int height, std::int64_t now_ns);

/// Returns one instrument's main figures as one line without a line end, for a log. \param now_ns CLOCK_MONOTONIC
std::string boardLine(const Watched& one, std::int64_t now_ns);

/// Returns all figures of one instrument, one per line. \param now_ns CLOCK_MONOTONIC
std::string boardText(const Watched& one, std::int64_t now_ns);

}  // namespace traction::cli

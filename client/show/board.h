// Draws the state of instruments for tractionctl top: all figures of one, or the main figures of several.
#pragma once

#include "client/show/canvas.h"
#include "client/show/scene.h"

#include <string>
#include <vector>

namespace traction::client {

/// An instrument that is shown.
struct Watched {
  std::string name;      ///< as requested: an endpoint, or the name of an instance
  std::string endpoint;  ///< empty: the name identifies it
  Scene scene;
  std::string failure;  ///< why nothing more can be received; empty: it can
};

/// Draws a page of width x height characters: all figures of each instrument if there is room, or else the main ones;
/// the last line states how many instruments have no room. Figures that are out of date are in brackets, with the
/// reason.
/// \param all not empty
/// \param now_ns CLOCK_MONOTONIC
Canvas drawBoard(const std::vector<Watched>& all, int width, int height, std::int64_t now_ns);

/// Returns one instrument's main figures, and what is wrong, as one line without a line end, for a log.
/// \param now_ns CLOCK_MONOTONIC
std::string boardLine(const Watched& one, std::int64_t now_ns);

/// Returns all figures of one instrument, and what is wrong, one per line; each line ends with a newline.
/// \param now_ns CLOCK_MONOTONIC
std::string boardText(const Watched& one, std::int64_t now_ns);

}  // namespace traction::client

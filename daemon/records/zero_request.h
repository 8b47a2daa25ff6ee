// A request for a zero.
#pragma once

#include <string>

namespace tractiond {

struct ZeroRequest {
  bool anyway = false;  ///< true: takes the zero even if something seems to touch the gel; not used for an undo
  bool undo = false;    ///< true: restores the previous zero instead of taking one
  std::string asker{};  ///< client that asks, as text
};

}  // namespace tractiond

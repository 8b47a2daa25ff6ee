// A request for a zero.
#pragma once

#include <string>

namespace tractiond {

struct ZeroRequest {
  bool anyway = false;  ///< even if something seems to touch the gel
  bool undo = false;    ///< restores the previous zero instead
  std::string asker{};  ///< requester, for the log
};

}  // namespace tractiond

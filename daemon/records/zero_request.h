// What is asked of the zero.
#pragma once

#include <string>

namespace tractiond {

struct ZeroRequest {
  bool anyway = false;  ///< also if something seems to touch the gel
  bool undo = false;    ///< instead: the zero before comes into force again
  std::string asker{};  ///< who asks, for people
};

}  // namespace tractiond

// The description of a camera with the quirks of many.
#pragma once

#include "tests/support/places.h"

#include <fstream>
#include <iterator>
#include <string>

namespace tractiond::capture {

inline std::string quirkyFile() {
  return test::source("tests/unit/capture/descriptions/quirky.xml");
}
inline std::string quirky() {
  std::ifstream file(quirkyFile());
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace tractiond::capture

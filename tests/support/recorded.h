// Texts that are compared with what was recorded.
#pragma once

#include "tests/support/places.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

namespace tractiond::test {

/// Expects a text to be that of a file of the source tree. If TRACTION_RECORD is set, writes the file anew: its
/// difference then shows what a change alters.
inline void expectAsRecorded(const std::string& text, const std::string& file) {
  const std::string path = source(file);
  if (std::getenv("TRACTION_RECORD") != nullptr) std::ofstream(path) << text;
  std::stringstream recorded;
  recorded << std::ifstream(path).rdbuf();
  EXPECT_EQ(text, recorded.str()) << path << "; if it shall be so, run the test with TRACTION_RECORD=1";
}

}  // namespace tractiond::test

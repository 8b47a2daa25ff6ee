// Gives each test a folder of its own.
#pragma once

#include "lens/report.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

namespace lens {

class Workplace : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_.path() / name; }

  static std::string content(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  static void write(const std::string& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
  }

  Report report;
  const tractiond::test::TemporaryFolder folder_;
};

}  // namespace lens

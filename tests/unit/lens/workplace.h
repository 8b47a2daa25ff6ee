// Gives each test a folder of its own.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace lens {

class Workplace : public testing::Test {
 protected:
  Workplace() {
    std::string path = testing::TempDir() + "/lens-XXXXXX";
    folder = mkdtemp(path.data());
  }
  ~Workplace() override { std::filesystem::remove_all(folder); }

  std::string path(const std::string& name) const { return folder / name; }

  static std::string content(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  static void write(const std::string& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
  }

  std::filesystem::path folder;
};

}  // namespace lens

// A folder of its own for each test, and a seed that is new in each run unless one is given.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>

namespace lens {

/// TRACTION_SEED repeats a run.
inline unsigned newSeed() {
  const char* given = std::getenv("TRACTION_SEED");
  const unsigned seed = given != nullptr ? static_cast<unsigned>(std::stoul(given)) : std::random_device{}();
  std::printf("seed %u\n", seed);
  return seed;
}

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

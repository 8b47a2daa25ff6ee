// For tools/fuzz: libFuzzer finds what leads further. FUZZ_SEEDS=DIRECTORY writes what to begin with, and ends.
#include "tests/fuzz/target.h"

#include <cstdlib>

extern "C" int LLVMFuzzerInitialize(int*, char***);
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  if (fuzz::begin != nullptr) fuzz::begin(*argc, *argv);
  const char* const directory = std::getenv("FUZZ_SEEDS");
  if (directory == nullptr) return 0;
  int number = 0;
  for (const std::string& seed : fuzz::seeds()) {
    std::ofstream(directory + ("/seed" + std::to_string(number++)), std::ios::binary) << seed;
  }
  std::exit(0);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::feed({reinterpret_cast<const char*>(data), size});
  return 0;
}

#include "tests/fuzz/target.h"
#include "twin/scenario.h"

#include <filesystem>

namespace fuzz {

std::vector<std::string> seeds() {
  std::vector<std::string> texts;
  for (const auto& file : std::filesystem::directory_iterator(SOURCE "/twin/scenarios")) {
    texts.push_back(fileText(file.path()));
  }
  return texts;
}

void feed(std::string_view bytes) {
  static_cast<void>(twin::parseScenario(bytes, "fuzz"));
}

}  // namespace fuzz

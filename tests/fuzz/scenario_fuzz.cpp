#include "tests/fuzz/target.h"
#include "tests/support/places.h"
#include "twin/scenario.h"

#include <algorithm>
#include <filesystem>

namespace fuzz {

std::vector<std::string> seeds() {
  std::vector<std::string> texts;
  for (const auto& file : std::filesystem::directory_iterator(tractiond::test::source("twin/scenarios"))) {
    texts.push_back(fileText(file.path()));
  }
  std::ranges::sort(texts);  // the same in every folder: a seed repeats a run
  return texts;
}

bool feed(std::string_view bytes) {
  // One that names a gel file gets this one, and opens no file of a name that chance has made.
  const bool namesGel = bytes.find("gel_file") != std::string_view::npos;
  return twin::parseScenario(bytes, "fuzz", namesGel ? tractiond::test::source("config/gels/paper.toml") : "")
      .has_value();
}

}  // namespace fuzz

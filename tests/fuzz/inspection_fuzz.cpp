#include "daemon/capture/inspection.h"
#include "tests/fuzz/target.h"

#include <algorithm>

namespace fuzz {

using tractiond::capture::Inspection;

std::vector<std::string> seeds() {
  std::vector<std::string> texts;
  for (const auto outcome : {Inspection::Outcome::kHarmless, Inspection::Outcome::kFault, Inspection::Outcome::kAbsent})
    texts.push_back(
        tractiond::capture::encodeInspection({outcome, tractiond::capture::hashOf("<RegisterDescription/>")}));
  return texts;
}

bool feed(std::string_view bytes) {
  const Inspection inspection = tractiond::capture::decodeInspection(bytes);
  require(!inspection.text.empty(), "an inspection says nothing");
  require(std::all_of(inspection.text.begin(), inspection.text.end(), [](char c) { return c >= ' ' && c <= '~'; }),
          "what a child prints reaches the log as it is");
  return tractiond::capture::encodeInspection(inspection) == bytes;
}

}  // namespace fuzz

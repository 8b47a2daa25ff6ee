// How well strokes are read that writers draw: by templates that they recorded themselves, and by the shipped ones.
//
// usage: evaluation_strokes ALPHABET WRITERS STROKES SEED      strokes of each symbol by each writer. Prints for each
// mode and kind of templates strokes, right and doubtful ones.
#include "client/input/strokes/stroke_reader.h"
#include "tests/support/handwriting.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

using namespace traction;
using namespace traction::input;

namespace {

constexpr double kStrangeness = 0.05;  ///< of a writer's own shapes
constexpr int kTaught = 3;             ///< strokes of each symbol that a writer records

struct Count {
  int all = 0, right = 0, doubtful = 0;
};

/// \param reader a copy: one that was read may have changed its mode
void read(StrokeReader reader, const Template& drawn, const Stroke& stroke, Count& count) {
  for (const auto& place : stroke) reader.move(place);
  const Reading reading = reader.end().value();
  const bool isWritten = reading.kind == Reading::Kind::kSymbol || reading.kind == Reading::Kind::kMode;
  ++count.all;
  count.right += isWritten && reading.symbol == drawn.symbol;
  count.doubtful += !isWritten;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) return 64;
  const auto shipped = loadAlphabet(argv[1]);
  if (!shipped) {
    std::fprintf(stderr, "%s\n", shipped.error().message().c_str());
    return shipped.error().exitCode;
  }
  std::mt19937_64 generator(static_cast<std::uint64_t>(std::atoll(argv[4])));
  for (const std::string_view mode : {kLetters, kDigits}) {
    Alphabet ofMode;
    std::ranges::copy_if(*shipped, std::back_inserter(ofMode), [&](const Template& each) { return each.mode == mode; });
    for (Template& each : ofMode) each.mode = kLetters;  // in which a reader begins
    const StrokeReader byShipped(ofMode);
    Count own, foreign;
    for (int number = std::atoi(argv[2]); number > 0; --number) {
      test::Writer writer(generator, kStrangeness);
      Alphabet taught;
      for (const Template& each : ofMode) {
        for (int i = 0; i < kTaught; ++i)
          taught.push_back({each.mode, each.symbol, writer.draw(each.symbol, each.stroke)});
      }
      const StrokeReader byOwn(taught);
      for (const Template& each : ofMode) {
        for (int i = std::atoi(argv[3]); i > 0; --i) {
          const Stroke stroke = writer.draw(each.symbol, each.stroke);
          read(byOwn, each, stroke, own);
          read(byShipped, each, stroke, foreign);
        }
      }
    }
    for (const auto& [name, count] : {std::pair("own", &own), std::pair("foreign", &foreign)}) {
      std::printf("%s %s %d %d %d\n", std::string(mode).c_str(), name, count->all, count->right, count->doubtful);
    }
  }
}

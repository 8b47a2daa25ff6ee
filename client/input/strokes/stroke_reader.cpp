#include "client/input/strokes/stroke_reader.h"

#include <algorithm>
#include <utility>

namespace traction::input {

double extent(const Stroke& stroke) {
  double largest = 0.0;
  for (const std::size_t axis : {0U, 1U}) {
    const auto by = [&](const auto& point) { return point[axis]; };
    const auto [least, most] = std::ranges::minmax(stroke, {}, by);
    largest = std::max(largest, most[axis] - least[axis]);
  }
  return largest;
}

StrokeReader::StrokeReader(const Alphabet& alphabet, const Options& options)
    : options_(options) {
  for (const Template& each : alphabet) modes_[each.mode].add(each.symbol, each.stroke);
}

std::optional<Reading> StrokeReader::end() {
  if (stroke_.empty()) return std::nullopt;
  const Stroke stroke = std::exchange(stroke_, {});
  if (!(extent(stroke) >= options_.leastExtent)) return Reading{};
  const Recogniser::Best best = modes_[mode_].recognise(stroke);
  Reading reading{Reading::Kind::kSymbol, best.symbol, best.margin, best.distance};
  if (best.symbol.empty() || best.margin < options_.leastMargin || best.distance > options_.mostDistance) {
    reading.kind = Reading::Kind::kDoubtful;
  } else if (best.symbol == kDigits || best.symbol == kLetters) {
    reading.kind = Reading::Kind::kMode;
    mode_ = best.symbol;
  }
  return reading;
}

}  // namespace traction::input

#include "client/input/strokes/stroke_reader.h"

#include <algorithm>
#include <array>
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
  // Leans and widens each as much as writers do all that they write.
  constexpr double kSlant = 0.2, kWide = 1.2;
  constexpr std::array<std::array<double, 2>, 5> kHands = {
      {{1.0, 0.0}, {1.0, kSlant}, {1.0, -kSlant}, {kWide, 0.0}, {1.0 / kWide, 0.0}}};
  for (const Template& each : alphabet) {
    for (const auto& [wide, slant] : kHands) {
      Stroke stroke = each.stroke;
      for (auto& [x, y] : stroke) x = wide * x + slant * y;
      modes_[each.mode].add(each.symbol, stroke);
    }
  }
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

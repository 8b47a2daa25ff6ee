#include "client/input/teacher.h"

#include "client/input/strokes/stroke_reader.h"

namespace traction::input {

void Teacher::write(const Touches& touches) {
  const std::uint64_t id = touches.touches.empty() ? 0 : touches.touches.front().id;
  if (id != id_) {
    // A lost sensor is no lift, and a tap no stroke.
    const bool isStroke = !taught_.stroke.empty() && extent(taught_.stroke) >= StrokeReader::Options().leastExtent;
    if (isStroke && touches.valid) out_ << textOf({taught_}) << std::flush;
    taught_.stroke.clear();
  }
  id_ = id;
  if (id == 0 || !touches.touches.front().seen) return;
  const auto [x, y] = touches.touches.front().position_m;
  taught_.stroke.push_back({1e3 * x, 1e3 * y});
}

}  // namespace traction::input

// Strokes as keys of a keyboard.
#pragma once

#include "client/input/events.h"
#include "client/input/strokes/alphabet.h"
#include "client/input/strokes/stroke_reader.h"
#include "client/input/touches.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

namespace traction::input {

struct TextOptions {
  std::filesystem::path alphabet;  ///< file of the strokes; empty: the shipped one
  double leastExtent_mm = 3.0;     ///< a smaller stroke is none
};

/// Types what one touch draws, when it is lifted. While there are several touches, and in what is drawn when the sensor
/// is lost, there is no stroke.
class Keyboard : public Output {
 public:
  static EventDevice::Ability ability();
  /// Returns whether a symbol of an alphabet can be typed.
  static bool canType(std::string_view symbol);

  Keyboard(EventDevice device, const Alphabet& alphabet, const TextOptions& options)
      : device_(std::move(device))
      , reader_(alphabet, {.leastExtent = options.leastExtent_mm}) {}

  void write(const Touches& touches) override;

 private:
  void type(const Reading& reading);

  EventDevice device_;
  StrokeReader reader_;
  std::uint64_t id_ = 0;     ///< of the touch that draws; 0: none
  bool areSeveral_ = false;  ///< until all are lifted
};

}  // namespace traction::input

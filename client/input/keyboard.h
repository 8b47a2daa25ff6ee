// Strokes, presses and turns as keys of a keyboard.
#pragma once

#include "client/input/events.h"
#include "client/input/presses.h"
#include "client/input/strokes/alphabet.h"
#include "client/input/strokes/stroke_reader.h"
#include "client/input/touches.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

namespace traction::input {

struct TextOptions {
  std::filesystem::path alphabet;  ///< file of the strokes; empty: the shipped one
  double leastExtent_mm = 3.0;     ///< a smaller stroke is none
  PressOptions press;
  /// What each Press types, as a symbol; empty: nothing.
  std::array<std::string, 4> pressSymbols = {"space", "enter", "left", "right"};
};

/// Types what one touch draws, when it is lifted; a tap and a hard press as well, and a turn when it begins. While
/// there are several touches, and in what is drawn when the sensor is lost, there is nothing of these.
class Keyboard : public Output {
 public:
  /// Returns what the device must be able to do, for EventDevice::make().
  static EventDevice::Ability ability();
  /// Returns the key code (linux/input-event-codes.h) that types a symbol; 0: there is none.
  static std::uint16_t keyOf(std::string_view symbol);
  /// Returns whether an alphabet may have a symbol.
  static bool canType(std::string_view symbol);

  Keyboard(EventDevice device, const Alphabet& alphabet, const TextOptions& options)
      : device_(std::move(device))
      , reader_(alphabet, {.leastExtent = options.leastExtent_mm})
      , presses_(options.press, 1e-3 * options.leastExtent_mm)
      , pressSymbols_(options.pressSymbols) {}

  void write(const Touches& touches) override;

 private:
  /// Ends the touch that draws.
  void end();
  void type(std::string_view symbol);
  void type(Press press) { type(pressSymbols_.at(static_cast<std::size_t>(press))); }

  EventDevice device_;
  StrokeReader reader_;
  Presses presses_;
  std::array<std::string, 4> pressSymbols_;
  std::uint64_t id_ = 0;     ///< of the touch that draws; 0: none
  bool areSeveral_ = false;  ///< until all are lifted
};

}  // namespace traction::input

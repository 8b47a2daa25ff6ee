// Prints strokes as an alphabet has them.
#pragma once

#include "client/input/strokes/alphabet.h"
#include "client/input/touches.h"

#include <cstdint>
#include <ostream>
#include <string>
#include <utility>

namespace traction::input {

/// Prints what the touch that began first draws, when it is lifted, as a [[stroke]] of a symbol. A tap, and a stroke at
/// whose end the sensor was lost, print nothing.
class Teacher : public Output {
 public:
  /// \param symbol that the printed strokes write
  /// \param areDigits true: the strokes are those of the mode kDigits, else of kLetters
  /// \param out must outlive this
  Teacher(std::string symbol, bool areDigits, std::ostream& out)
      : taught_{.mode = std::string(areDigits ? kDigits : kLetters), .symbol = std::move(symbol), .stroke = {}}
      , out_(out) {}

  void write(const Touches& touches) override;

 private:
  Template taught_;
  std::ostream& out_;
  std::uint64_t id_ = 0;  ///< of the touch that draws; 0: none
};

}  // namespace traction::input

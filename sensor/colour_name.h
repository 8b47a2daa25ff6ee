// Names of marker colours in messages and gel files.
#pragma once

#include "sensor/gel.h"

namespace sensor {

/// Returns the lower-case English name, such as "blue", as gel files spell it. Never null.
inline const char* nameOf(Colour colour) {
  switch (colour) {
  case Colour::kBlue:
    return "blue";
  case Colour::kRed:
    return "red";
  case Colour::kGreen:
    return "green";
  case Colour::kGrey:
    return "grey";
  }
  return "";
}

}  // namespace sensor

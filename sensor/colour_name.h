// What people and gel files call the colours of markers.
#pragma once

#include "sensor/gel.h"

namespace sensor {

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

// A picture of one's own, of the camera's memory that is given back.
#pragma once

#include "daemon/records/frame.h"

#include <cstdint>
#include <cstring>
#include <vector>

namespace tractiond {

/// Who wants one makes the room; who takes one allocates nothing.
struct FrameCopy {
  std::vector<std::uint8_t> bytes;  ///< as the camera sent them
  bool fits = false;                ///< there was room; else frame.size says how much is needed
  Frame frame;                      ///< its data is `bytes`

  void take(const Frame& from) {
    frame = from;
    frame.data = bytes.data();
    frame.token = nullptr;
    fits = from.size <= bytes.size();
    if (fits) std::memcpy(bytes.data(), from.data, from.size);
  }

  /// For one like that which did not fit.
  void makeRoom() { bytes.resize(frame.size); }
};

}  // namespace tractiond

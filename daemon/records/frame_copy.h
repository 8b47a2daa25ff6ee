// A copy of a frame in memory of its own, so that the camera's memory can be given back.
#pragma once

#include "daemon/records/frame.h"

#include <cstdint>
#include <cstring>
#include <vector>

namespace tractiond {

/// The thread that wants a copy calls makeRoom(); the thread that calls copyFrom() does not allocate.
struct FrameCopy {
  std::vector<std::uint8_t> bytes;  ///< as the camera sent them; may be longer than the frame
  bool fits = false;                ///< false: `bytes` was too short for the last frame, which was not copied
  Frame frame;                      ///< its data is `bytes`; valid if `fits`

  /// Copies a frame and sets `fits` if `bytes` has room for it; else sets `fits` to false and notes the frame's size
  /// in `frame`. Allocates nothing. The copy refers to `bytes` alone: the source may be given back, and `token` is
  /// nullptr. A copy of this struct still refers to these `bytes`.
  void copyFrom(const Frame& from) {
    frame = from;
    frame.data = bytes.data();
    frame.token = nullptr;
    fits = from.size <= bytes.size();
    if (fits) std::memcpy(bytes.data(), from.data, from.size);
  }

  /// Makes room for frames of up to `size` bytes, before the first of them comes: of a triggered camera it may be the
  /// only one. Allocates if there is less. `frame` has no valid data then until the next copyFrom().
  void makeRoom(std::size_t size) {
    if (size > bytes.size()) bytes.resize(size);
  }
};

}  // namespace tractiond

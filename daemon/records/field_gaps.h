// Finds the fields that do not follow the one before.
#pragma once

#include "daemon/records/traction_field.h"

namespace tractiond {

/// Sets kDiscontinuity. It is used where fields leave, as only there it is known which frames have none, whatever they
/// were lost by: the camera, the frame gate, or a link.
class FieldGaps {
 public:
  /// Returns kDiscontinuity if the frame before this one has no field, or if ids or clock jumped between the two; else
  /// 0. Of the first field only such a jump counts. Must be called for each field, in order.
  std::uint32_t before(const FrameInfo& frame) {
    const bool follows = last_ == 0 || frame.frameNumber == last_ + 1;
    last_ = frame.frameNumber;
    return follows && !frame.discontinuity ? 0U : kDiscontinuity;
  }

  /// Sets the flag in a field and in its markers.
  void mark(TractionField& field) {
    const std::uint32_t flag = before(field.markers.info);
    field.flags |= flag;
    field.markers.flags |= flag;
  }

 private:
  std::uint64_t last_ = 0;  ///< number of the frame of the field before; 0: there was none
};

}  // namespace tractiond

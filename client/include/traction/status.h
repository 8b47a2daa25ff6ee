// The daemon's state, published once a second whether or not frames arrive.
#pragma once

#include "traction/description.h"

#include <memory>

namespace traction {

namespace v1 {
class Status;
}

/// The message of proto/traction/v1/status.proto, where its fields are described, and its header decoded. To read its
/// fields, include "traction/v1/status.pb.h" and link traction::proto.
struct Status {
  Header header;
  std::shared_ptr<const v1::Status> message;  ///< never null in what Control and Subscriber return

  /// Returns the message, for its fields: `status->uptime_s()`. Null if `message` is.
  const v1::Status* operator->() const { return message.get(); }
};

}  // namespace traction

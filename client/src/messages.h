// What published messages and replies have in common. Only who includes this sees Protobuf.
#pragma once

#include "traction/control.h"
#include "traction/subscriber.h"
#include "traction/v1/description.pb.h"
#include "traction/v1/status.pb.h"

#include <string_view>

namespace traction {

namespace pb = traction::v1;

// All throw Error kMalformed.
inline void require(bool condition, const char* what) {
  if (!condition) throw Error(ErrorCode::kMalformed, what);
}

template <typename Parsed>
Parsed parse(std::string_view bytes) {
  Parsed message;
  require(message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())),
          "what arrived is no message of tractiond");
  return message;
}

Colour colourOf(pb::Colour colour);
Zero zeroOf(const pb::Zero& from);
Description descriptionOf(const pb::Description& from);
Status statusOf(const pb::Status& from);

}  // namespace traction

// Decoding that published messages and replies share. Only files that include this header see Protobuf.
#pragma once

#include "traction/control.h"
#include "traction/subscriber.h"
#include "traction/v1/description.pb.h"
#include "traction/v1/status.pb.h"

#include <string_view>

namespace traction {

namespace pb = traction::v1;

// The functions below throw Error kMalformed for invalid messages. A colour of a later daemon becomes kUnknown.
/// Throws `what` as an error unless `condition` holds.
inline void require(bool condition, const char* what) {
  if (!condition) throw Error(ErrorCode::kMalformed, what);
}

/// Parses one Protobuf message.
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
Status statusOf(pb::Status from);

}  // namespace traction

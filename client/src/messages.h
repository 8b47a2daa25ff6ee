// Decodes the parts that published messages and replies share. Only files that include this header see Protobuf.
#pragma once

#include "traction/control.h"
#include "traction/subscriber.h"
#include "traction/v1/description.pb.h"
#include "traction/v1/status.pb.h"

#include <string_view>

namespace traction {

namespace pb = traction::v1;

// Reentrant. The functions below throw Error kMalformed for invalid messages.

/// Throws Error kMalformed with the text `what` unless `condition` holds.
inline void require(bool condition, const char* what) {
  if (!condition) throw Error(ErrorCode::kMalformed, what);
}

/// Parses one Protobuf message from all of `bytes`, which need not outlive the call and must be less than 2 GiB.
template <typename Parsed>
Parsed parse(std::string_view bytes) {
  Parsed message;
  require(message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())),
          "what arrived is no message of tractiond");
  return message;
}

/// Converts an enum of the protocol to that of the library, which has the same numbers. One that only a later daemon
/// knows becomes that of 0: none, or unknown.
/// \param last of the library's enumerators
template <typename Own, typename Wire>
Own enumOf(Wire from, Own last) {
  return from < 0 || static_cast<int>(from) > static_cast<int>(last) ? Own{} : static_cast<Own>(from);
}
/// Converts a zero; fails if its positions and presences differ in number, or a position is not finite.
Zero zeroOf(const pb::Zero& from);
/// Converts a description, and sets sameHost if the daemon's host has the same boot id of the kernel as this one. Fails
/// if arrays of the zero or the body differ in size, if a vector is incomplete, if an id is neither empty nor of 16
/// bytes, or if a number of the gel, a layer, the nodes, the camera, the zero or the body is not finite. Does not check
/// the numbers of the header and the solver.
Description descriptionOf(const pb::Description& from);
/// Takes over a status and decodes its header. Fails if an id is neither empty nor of 16 bytes, or if a histogram has
/// counts, but not one more than bounds. Does not check that numbers are finite.
Status statusOf(pb::Status from);

}  // namespace traction

// Rewrites requests and writes error replies. The only file of this room that includes *.pb.h.
#pragma once

#include <tl/expected.hpp>

#include <string>
#include <string_view>

namespace tractiond::gateway {

/// Returns the request (a traction.v1.Request as Protobuf bytes) with `asker` as its on_behalf_of field, whatever that
/// field held. On failure returns a sentence for the client: the bytes are not a request, or the result has more than
/// the 64 KiB that the instrument accepts. Thread-safe; turns off Protobuf's own log for the process.
tl::expected<std::string, std::string> signedRequest(std::string_view bytes, const std::string& asker);

/// Returns the Protobuf bytes of a traction.v1.Reply with this error.
std::string errorReply(const std::string& sentence);

}  // namespace tractiond::gateway

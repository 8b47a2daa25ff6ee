// Rewrites requests and writes error replies. The only file of this room that includes *.pb.h.
#pragma once

#include <tl/expected.hpp>

#include <string>
#include <string_view>

namespace tractiond::gateway {

/// Returns the request with `asker` as its on_behalf_of field, whatever that field held. On failure returns a sentence
/// for the client: the bytes are not a request, or are more than the instrument accepts.
tl::expected<std::string, std::string> signedRequest(std::string_view bytes, const std::string& asker);

/// Returns the bytes of a Reply with this error.
std::string errorReply(const std::string& sentence);

}  // namespace tractiond::gateway

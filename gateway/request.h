// What a gateway changes in requests and answers itself. The only file of this room that sees *.pb.h.
#pragma once

#include <tl/expected.hpp>

#include <string>
#include <string_view>

namespace tractiond::gateway {

/// The request with who asks, whatever it said of that itself. The error is a sentence for the asker: it is none, or
/// larger than the instrument takes.
tl::expected<std::string, std::string> signedRequest(std::string_view bytes, const std::string& asker);

std::string errorReply(const std::string& sentence);

}  // namespace tractiond::gateway

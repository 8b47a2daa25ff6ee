// Decodes published messages of proto/traction/v1.
#pragma once

#include "traction/subscriber.h"

#include <string_view>

namespace traction {

/// Decodes the Protobuf bytes of one message, which need not outlive the call. Checks shapes, and that the numbers of a
/// field, markers, contacts, a grasp, a preview and a description are finite, not those of a header, a description's
/// solver and a status. Header::arrived_ns is 0. Reentrant.
/// \param topic one of Topics
/// \throws Error kMalformed
Message decode(unsigned topic, std::string_view bytes);

}  // namespace traction

// Decodes published messages of proto/traction/v1.
#pragma once

#include "traction/subscriber.h"

#include <string_view>

namespace traction {

// Decode the Protobuf bytes of one message, which need not outlive the call. They check shapes, and that the numbers of
// a field, markers, contacts, a grasp, a preview and a description are finite, not those of a header, a description's
// solver and a status; they throw Error kMalformed. Header::arrived_ns is 0. Reentrant.
Field decodeField(std::string_view bytes);
Markers decodeMarkers(std::string_view bytes);
Description decodeDescription(std::string_view bytes);
Status decodeStatus(std::string_view bytes);
Preview decodePreview(std::string_view bytes);
Contacts decodeContacts(std::string_view bytes);
Grasp decodeGrasp(std::string_view bytes);

}  // namespace traction

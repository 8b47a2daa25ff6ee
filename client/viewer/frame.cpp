#include "client/viewer/frame.h"

#include <array>

namespace traction::view {

Frame makeFrame(std::string_view topic, std::string_view bytes) {
  auto frame = std::make_shared<std::string>();
  frame->reserve(topic.size() + 1 + bytes.size());
  frame->append(topic).append(1, '\0').append(bytes);
  return frame;
}

unsigned kindOf(const Message& message) {
  constexpr std::array<unsigned, 7> kKinds = {kField,   kMarkers,  kDescription, kStatus,
                                              kPreview, kContacts, kGrasp};  // as in Message
  return kKinds.at(message.index());
}

const char* nameOf(ErrorCode code) {
  switch (code) {
  case ErrorCode::kBadEndpoint:
    return "bad_endpoint";
  case ErrorCode::kNoAnswer:
    return "no_answer";
  case ErrorCode::kVersion:
    return "version";
  case ErrorCode::kMalformed:
    return "malformed";
  case ErrorCode::kRefused:
    return "refused";
  case ErrorCode::kBadKeys:
    return "bad_keys";
  case ErrorCode::kNotAllowed:
    return "not_allowed";
  }
  return "";
}

Frame errorFrame(const Error& error) {
  return makeFrame("error", std::string(nameOf(error.code())) + ' ' + error.what());
}

}  // namespace traction::view

#include "client/viewer/frame.h"

#include <array>

namespace traction::view {

Frame makeFrame(std::string_view topic, std::string_view bytes) {
  auto frame = std::make_shared<std::string>();
  frame->reserve(topic.size() + 1 + bytes.size());
  frame->append(topic).append(1, '\0').append(bytes);
  return frame;
}

Frame errorFrame(const Error& error, const std::string& id) {
  constexpr std::array kNames = {"bad_endpoint", "no_answer", "version",    "malformed",
                                 "refused",      "bad_keys",  "not_allowed"};  // as in ErrorCode
  return makeFrame(id.empty() ? "error" : "error/" + id,
                   std::string(kNames.at(static_cast<std::size_t>(error.code()))) + ' ' + error.what());
}

}  // namespace traction::view

#include "gateway/handshake.h"

namespace tractiond::gateway {
namespace {

network::Permission neededFor(std::string_view domain) {
  return domain == kControlDomain || domain == kPreviewDomain ? network::Permission::kControl
                                                              : network::Permission::kRead;
}

}  // namespace

HandshakeAnswer answerHandshake(std::vector<std::string> request, const MayEnter& mayEnter) {
  constexpr std::size_t kParts = 7;
  const std::string key = request.size() == kParts ? network::keyOfBytes(request[6]) : "";
  const network::AllowedKey* const allowed = key.empty() || request[5] != "CURVE" ? nullptr : mayEnter(key);
  request.resize(kParts);
  std::string why;
  if (allowed == nullptr) {
    why = "the key '" + key + "' is not allowed";
  } else if (allowed->permission < neededFor(request[2])) {
    why = "\"" + allowed->name + "\" may only read";
  }
  if (allowed != nullptr && why.empty())
    return {.parts = {request[0], request[1], "200", "", allowed->name, ""}, .refused = {}};
  return {.parts = {request[0], request[1], "400", why, "", ""},
          .refused = "a peer at " + request[3] + " is refused: " + why};
}

}  // namespace tractiond::gateway

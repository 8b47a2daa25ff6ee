#include "daemon/publish/wire_control.h"
#include "gateway/request.h"
#include "tests/fuzz/target.h"
#include "traction/v1/control.pb.h"

namespace fuzz {

std::vector<std::string> seeds() {
  traction::v1::Request request;
  request.set_version(1);
  request.mutable_zero()->set_anyway(true);
  request.set_on_behalf_of("somebody else");
  return {request.SerializeAsString()};
}

/// Whatever a peer sends: what the instrument reads of it has the asker whom the gateway knows.
bool feed(std::string_view bytes) {
  const auto text = tractiond::gateway::signedRequest(bytes, "ada at 127.0.0.1");
  if (!text) return false;
  const auto asked = tractiond::publish::decodeRequest(*text);
  require(!asked || asked->onBehalfOf == "ada at 127.0.0.1", "it names another asker");
  return asked.has_value();
}

}  // namespace fuzz

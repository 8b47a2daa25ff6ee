#include "client/src/handshake.h"

#include "base/network/keys.h"

#include <cstring>

namespace traction {

Keys loadKeys(const std::string& path) {
  auto keys = tractiond::network::loadKeyPair(path);
  if (!keys) throw Error(ErrorCode::kBadKeys, keys.error().message());
  return {keys->serverKey, keys->publicKey, keys->secretKey};
}

void useKeys(zmq::socket_t& socket, const Keys& keys) {
  if (keys.serverKey.empty()) return;
  for (const auto& [what, key] :
       {std::pair("server key", &keys.serverKey), {"public key", &keys.publicKey}, {"secret key", &keys.secretKey}}) {
    if (tractiond::network::isKey(*key)) continue;
    // The message does not show the secret key.
    throw Error(ErrorCode::kBadKeys, std::string("the ") + what + (key == &keys.secretKey ? "" : " '" + *key + "'") +
                                         " is not a key: 40 letters of Z85; in a shell they stand in single quotes");
  }
  socket.set(zmq::sockopt::curve_serverkey, keys.serverKey);
  socket.set(zmq::sockopt::curve_publickey, keys.publicKey);
  socket.set(zmq::sockopt::curve_secretkey, keys.secretKey);
}

std::optional<Error> Handshake::process(std::uint16_t event, std::uint32_t value) {
  constexpr int kMostFailures = 5;  // about 0.5 s
  switch (event) {
  case ZMQ_EVENT_HANDSHAKE_SUCCEEDED:
    succeeded_ = true;
    failures_ = 0;
    return std::nullopt;
  case ZMQ_EVENT_HANDSHAKE_FAILED_AUTH:
    return Error(ErrorCode::kNotAllowed,
                 "the gateway at " + endpoint_ +
                     " does not let this key do that; on its box, tractionctl keys list tells who may do what");
  case ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL:
    // A mismatch is not seen at each attempt: the other side notices it too, and may close the connection first.
    if (value != ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH) return std::nullopt;
    return Error(ErrorCode::kNotAllowed, hasKeys_
                                             ? "who is at " + endpoint_ + " knows no keys; is it a gateway?"
                                             : "the gateway at " + endpoint_ + " asks for a key, and none is given");
  case ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL:
    // Also happens when a gateway restarts or has too many connections, so a client that was admitted before waits.
    // Without keys, the mismatch tells what is wrong.
    if (succeeded_ || !hasKeys_ || ++failures_ < kMostFailures) return std::nullopt;
    failures_ = 0;
    return Error(ErrorCode::kNotAllowed,
                 "who is at " + endpoint_ +
                     " ends each connection: the server key is not this gateway's, or too many are connected; on its "
                     "box, tractionctl keys list tells its key");
  default:
    return std::nullopt;
  }
}

std::pair<std::uint16_t, std::uint32_t> eventOf(const zmq::message_t& message) {
  std::pair<std::uint16_t, std::uint32_t> event{};
  if (message.size() < sizeof event.first + sizeof event.second) return event;
  std::memcpy(&event.first, message.data(), sizeof event.first);
  std::memcpy(&event.second, message.data<char>() + sizeof event.first, sizeof event.second);
  return event;
}

}  // namespace traction

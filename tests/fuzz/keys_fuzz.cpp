#include "base/network/keys.h"
#include "tests/fuzz/target.h"

namespace fuzz {

std::vector<std::string> seeds() {
  // Two keys of ZeroMQ's manual, page zmq_curve(7).
  const std::string publicKey = "rq:rM>}U?@Lns47E1%kR.o@n%FcmmsL/@{H8]yf7";
  const std::string pair = "public = \"" + publicKey + "\"\nsecret = \"JTKVSB%%)wK0E.X)V>+}o?pNmC{O&4W4b!Ni{Lh6\"\n";
  return {pair, pair + "server = \"" + publicKey + "\"\n"};
}

bool feed(std::string_view bytes) {
  const MemoryFile file(bytes);
  return tractiond::network::loadKeyPair(file.path()).has_value();
}

}  // namespace fuzz

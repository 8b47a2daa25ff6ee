#include "gateway/keys.h"
#include "tests/fuzz/target.h"

namespace fuzz {

std::vector<std::string> seeds() {
  const auto keys = tractiond::gateway::newKeyPair();
  const std::string pair = "public = \"" + keys.publicKey + "\"\nsecret = \"" + keys.secretKey + "\"\n";
  return {pair, pair + "server = \"" + keys.publicKey + "\"\n"};
}

bool feed(std::string_view bytes) {
  const MemoryFile file(bytes);
  return tractiond::gateway::loadKeyPair(file.path()).has_value();
}

}  // namespace fuzz

#include "gateway/keys.h"
#include "tests/fuzz/target.h"

namespace fuzz {

std::vector<std::string> seeds() {
  const auto keys = tractiond::gateway::newKeyPair();
  return {"public = \"" + keys.publicKey + "\"\nsecret = \"" + keys.secretKey + "\"\nserver = \"" + keys.publicKey +
              "\"\n",
          "key = \"" + keys.publicKey + "\"\npermission = \"control\"\n"};
}

void feed(std::string_view bytes) {
  const MemoryFile file(bytes);
  static_cast<void>(tractiond::gateway::loadKeyPair(file.path()));
}

}  // namespace fuzz

// Keys for a tractiond behind a traction-gateway.
#pragma once

#include "traction/export.h"

#include <string>

namespace traction {

/// CURVE keys, each as 40 characters of Z85. Without a server key the connection is neither authenticated nor
/// encrypted.
struct Keys {
  std::string serverKey;             ///< public key of the gateway
  std::string publicKey, secretKey;  ///< key pair of this client
};

/// Reads a key pair from a file that `tractionctl keys new` wrote, and the server key, which stays empty if the file
/// has none. Reentrant.
/// \throws Error kBadKeys if the file cannot be read, is not valid, its keys are not a pair, or its mode lets others
/// than its owner read, write or execute it (the group of a file of root may read it)
TRACTION_EXPORT Keys loadKeys(const std::string& path);

}  // namespace traction

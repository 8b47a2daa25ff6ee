// Keys, for a tractiond that is met through a traction-gateway.
#pragma once

#include "traction/export.h"

#include <string>

namespace traction {

/// CURVE's, as 40 letters of Z85. Without a server key nobody is asked, and nothing is encrypted.
struct Keys {
  std::string serverKey;             ///< of the gateway's box, public
  std::string publicKey, secretKey;  ///< of this side
};

/// From a file of `tractionctl keys new`; the server's key where the file has it. \throws Error kBadKeys
TRACTION_EXPORT Keys loadKeys(const std::string& path);

}  // namespace traction

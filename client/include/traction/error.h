// What the library throws.
#pragma once

#include "traction/export.h"

#include <stdexcept>

namespace traction {

enum class ErrorCode {
  kBadEndpoint,  ///< no such endpoint or instance name
  kNoAnswer,     ///< nobody answered in time
  kVersion,      ///< the daemon speaks another version of the protocol
  kMalformed,    ///< what arrived is no message of the protocol
  kRefused,      ///< the daemon could not do it; what() is its sentence
  kBadKeys,      ///< what was given as keys is none, or their file cannot be read
  kNotAllowed,   ///< a gateway does not let this side in, or not to this
};

class TRACTION_EXPORT Error : public std::runtime_error {
 public:
  Error(ErrorCode code, const std::string& what)
      : std::runtime_error(what)
      , code_(code) {}

  ErrorCode code() const { return code_; }

 private:
  ErrorCode code_;
};

}  // namespace traction

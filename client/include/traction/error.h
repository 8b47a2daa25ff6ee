// The exception of this library.
#pragma once

#include "traction/export.h"

#include <stdexcept>

namespace traction {

enum class ErrorCode {
  kBadEndpoint,  ///< invalid endpoint or instance name, or an endpoint of another kind
  kNoAnswer,     ///< no daemon at the endpoint, no permission to open its socket, no answer in time, or no memory left
  kVersion,      ///< the daemon uses another version of the protocol
  kMalformed,    ///< what arrived is not a valid message of the protocol
  kRefused,      ///< the daemon refused the request; what() is its reason
  kBadKeys,      ///< not a key, or the key file cannot be read
  kNotAllowed,   ///< the gateway refuses this key, or this key may not do this
};

/// Thrown by the functions of this library, where their comments state it; what() is a sentence for the operator.
class TRACTION_EXPORT Error : public std::runtime_error {
 public:
  /// \param code kind of the error, for programs
  /// \param what a sentence for the operator
  Error(ErrorCode code, const std::string& what)
      : std::runtime_error(what)
      , code_(code) {}

  ErrorCode code() const { return code_; }  ///< Returns the kind of the error.

 private:
  ErrorCode code_;
};

}  // namespace traction

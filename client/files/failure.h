// The error that ends a program of the client.
#pragma once

#include <tl/expected.hpp>

#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

namespace traction::client {

/// A failed or incomplete operation, on a file of the user or a port, with an exit code of sysexits.h.
class Failure : public std::runtime_error {
 public:
  Failure(int exitCode, const std::string& what)
      : std::runtime_error(what)
      , exitCode_(exitCode) {}
  int exitCode() const { return exitCode_; }

 private:
  int exitCode_;
};

/// Returns the value.
/// \throws Failure with exit code and message of the error, if there is none
template <typename Value, typename Reason>
Value orThrow(tl::expected<Value, Reason> outcome) {
  if (!outcome) throw Failure(outcome.error().exitCode, outcome.error().message());
  if constexpr (!std::is_void_v<Value>) return *std::move(outcome);
}

}  // namespace traction::client

// The error of an operation on a user's file: a recording, an export, keys.
#pragma once

#include <tl/expected.hpp>

#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

namespace traction::client {

/// A failed or incomplete operation, with an exit code of sysexits.h.
class FileError : public std::runtime_error {
 public:
  FileError(int exitCode, const std::string& what)
      : std::runtime_error(what)
      , exitCode_(exitCode) {}
  int exitCode() const { return exitCode_; }

 private:
  int exitCode_;
};

/// Returns the value. \throws FileError with exit code and message of the error, if there is none
template <typename Value, typename Failure>
Value orThrow(tl::expected<Value, Failure> outcome) {
  if (!outcome) throw FileError(outcome.error().exitCode, outcome.error().message());
  if constexpr (!std::is_void_v<Value>) return *std::move(outcome);
}

}  // namespace traction::client

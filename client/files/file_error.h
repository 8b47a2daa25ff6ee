// The error of an operation on a user's file: a recording, an export, keys.
#pragma once

#include <stdexcept>
#include <string>

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

}  // namespace traction::client

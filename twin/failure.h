// The error type of traction-twin.
#pragma once

#include <string>

namespace twin {

/// An error that ends the program.
struct Failure {
  int exitCode;         ///< from sysexits.h
  std::string message;  ///< one line: what, where, what to do
};

}  // namespace twin

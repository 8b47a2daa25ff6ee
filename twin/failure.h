// What ends the twin before its time.
#pragma once

#include <string>

namespace twin {

struct Failure {
  int exitCode;         ///< of sysexits.h
  std::string message;  ///< one line: what, where, what to do
};

}  // namespace twin

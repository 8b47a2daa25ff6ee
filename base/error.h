// An error that prevents a start: what is wrong, where, and how to mend it.
#pragma once

#include <sysexits.h>

#include <string>

namespace tractiond {

/// Returned by functions that fail; the callers decide whether it is logged and whether the program ends.
struct Error {
  int exitCode = EX_SOFTWARE;  ///< of sysexits.h
  std::string what = {};       ///< "camera.packet_size_bytes = 70000 is above the largest value 65500"
  std::string where = {};      ///< "tractiond.toml:12"; may be empty
  std::string remedy = {};     ///< "set it to 0 to use the interface's MTU"; may be empty

  /// Returns one line: "where: what; remedy", without the parts that are empty.
  std::string message() const {
    return (where.empty() ? "" : where + ": ") + what + (remedy.empty() ? "" : "; " + remedy);
  }
};

}  // namespace tractiond

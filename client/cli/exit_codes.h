// Exit codes of tractionctl (sysexits.h), and the errors that lead to them.
#pragma once

#include <exception>
#include <stdexcept>
#include <string>

namespace traction::client {

/// The daemon runs but cannot publish fields: it has no camera or no gel file.
class NoField : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Lists the exit codes, for --help.
extern const char* const kExitCodes;

/// Prints an error on standard error, cut to 2,000 bytes, with '?' for what is not printable. Returns `exitCode`.
int fail(int exitCode, const std::string& what);

/// Prints an exception as fail() does. Returns its exit code: that of a FileError, EX_NOINPUT for
/// NoField, EX_IOERR for OutputError; for an Error EX_USAGE (kBadEndpoint), EX_UNAVAILABLE (kNoAnswer), EX_PROTOCOL
/// (kVersion, kMalformed), EX_TEMPFAIL (kRefused), EX_CONFIG (kBadKeys) or EX_NOPERM (kNotAllowed); EX_SOFTWARE for all
/// others.
int fail(const std::exception& error);

}  // namespace traction::client

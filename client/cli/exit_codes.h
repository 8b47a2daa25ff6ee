// Exit codes of tractionctl (sysexits.h), and the errors that lead to them.
#pragma once

#include <exception>
#include <string>

namespace traction::client {

/// Lists the exit codes, for --help.
extern const char* const kExitCodes;

/// Prints an error on standard error, cut to 2,000 bytes, with '?' for what is not printable. Returns `exitCode`.
int fail(int exitCode, const std::string& what);

/// Prints an exception as fail() does. Returns its exit code: that of a Failure, EX_IOERR for
/// OutputError; for an Error EX_USAGE (kBadEndpoint), EX_UNAVAILABLE (kNoAnswer), EX_PROTOCOL
/// (kVersion, kMalformed), EX_TEMPFAIL (kRefused), EX_CONFIG (kBadKeys) or EX_NOPERM (kNotAllowed); EX_SOFTWARE for all
/// others.
int fail(const std::exception& error);

}  // namespace traction::client

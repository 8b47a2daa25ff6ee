// Exit codes of tractionctl (sysexits.h), and the errors that lead to them.
#pragma once

#include <string>

namespace traction::cli {

/// Lists the exit codes, for --help.
extern const char* const kExitCodes;

/// Prints an error on standard error, cut to 2,000 characters, with '?' for what is not printable. Returns `exitCode`.
int fail(int exitCode, const std::string& what);

/// Prints the exception that is being handled, which may be any std::exception. Returns its exit code.
int failByException();

}  // namespace traction::cli

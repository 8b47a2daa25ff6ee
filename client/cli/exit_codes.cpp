#include "client/cli/exit_codes.h"

#include "base/printable.h"
#include "client/cli/commands.h"
#include "client/files/failure.h"
#include "client/show/output.h"

#include <sysexits.h>

#include <array>
#include <cstddef>
#include <iostream>

namespace traction::client {

namespace {

/// By ErrorCode.
constexpr std::array kOfErrors = {EX_USAGE,    EX_UNAVAILABLE, EX_PROTOCOL, EX_PROTOCOL,
                                  EX_TEMPFAIL, EX_CONFIG,      EX_NOPERM};
static_assert(kOfErrors.size() == static_cast<std::size_t>(ErrorCode::kNotAllowed) + 1);

}  // namespace

const char* const kExitCodes = R"(Exit codes (sysexits.h):
   0  done
  64  wrong command line
  65  a recording is cut off or damaged (its intact part is read), is no recording, or is of another sensor
  66  status: tractiond runs, but can publish no field: its camera is lost or not there yet, or there is no gel file.
      A file cannot be read
  69  no tractiond answers
  73  a file cannot be created; for a recording also: it exists already
  74  standard output or a file cannot be written: the disk is full, or the reader of a pipe has ended
  75  tractiond could not carry out the request
  76  tractiond uses another version of the protocol, or a recording is of a newer version
  77  the gateway does not allow this key to do that, or there is no permission to change keys
  78  a file of keys is wrong)";

int fail(int exitCode, const std::string& what) {
  constexpr std::size_t kLongest = 2000;  // an answer of the daemon may have any length
  std::cerr << "tractionctl: " << printable(std::string_view(what).substr(0, kLongest)) << '\n';
  return exitCode;
}

int fail(const std::exception& error) {
  if (const auto* file = dynamic_cast<const Failure*>(&error)) return fail(file->exitCode(), error.what());
  if (const auto* ours = dynamic_cast<const Error*>(&error))
    return fail(kOfErrors.at(static_cast<std::size_t>(ours->code())), error.what());
  if (dynamic_cast<const OutputError*>(&error) != nullptr) return fail(EX_IOERR, error.what());
  return fail(EX_SOFTWARE, error.what());
}

}  // namespace traction::client

// traction-touch: parses the arguments, runs, and returns the exit code.
#include "client/touch/arguments.h"
#include "client/touch/serve.h"

#include <sysexits.h>

#include <exception>
#include <new>

int main(int argc, char** argv) try {
  const auto arguments = traction::contacts::parseArguments(argc, argv);
  return arguments ? traction::contacts::serve(*arguments) : arguments.error();
} catch (const traction::Error& error) {
  return traction::contacts::failed(
      {.exitCode = error.code() == traction::ErrorCode::kBadKeys ? EX_CONFIG : EX_USAGE, .what = error.what()});
} catch (const std::bad_alloc&) {
  return traction::contacts::failed(
      {.exitCode = EX_OSERR, .what = "there is no memory left", .remedy = "see MemoryMax= of the service"});
} catch (const std::exception& error) {
  return traction::contacts::failed({.exitCode = EX_OSERR, .what = error.what()});
}

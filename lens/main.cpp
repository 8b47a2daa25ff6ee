// traction-lens: calibrates the camera's lens and pose before the gel is calibrated.
#include "lens/arguments.h"

#include <iostream>

namespace {

int fail(int exitCode, const std::string& what) {
  std::cerr << "traction-lens: " << what << '\n';
  return exitCode;
}

/// Prints one line per fault and returns the exit code of the first one.
int report(const lens::Done& done) {
  if (done) return EX_OK;
  for (const tractiond::Error& error : done.error()) fail(error.exitCode, error.message());
  return done.error().front().exitCode;
}

}  // namespace

int main(int argc, char** argv) try {
  const auto command = lens::parseArguments(argc, argv);
  return command ? report((*command)()) : command.error();
} catch (const std::exception& error) {
  return fail(EX_SOFTWARE, error.what());
}

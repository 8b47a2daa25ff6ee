// traction-lens: calibrates the camera's lens and pose before the gel is calibrated.
#include "lens/arguments.h"

#include <iostream>

namespace {

int fail(int exitCode, const std::string& what) {
  std::cerr << "traction-lens: " << what << '\n';
  return exitCode;
}

/// Runs the command and prints its report, and a line for each fault. Returns the exit code of the first one.
int run(const lens::Request& request) {
  lens::Report report;
  const lens::Done done = request.command(report);
  const lens::Faults faults = done ? lens::Faults() : done.error();
  std::cout << (request.json ? report.json(faults) + "\n" : report.text());
  for (const tractiond::Error& error : faults) fail(error.exitCode, error.message());
  return faults.empty() ? EX_OK : faults.front().exitCode;
}

}  // namespace

int main(int argc, char** argv) try {
  const auto request = lens::parseArguments(argc, argv);
  return request ? run(*request) : request.error();
} catch (const std::exception& error) {
  return fail(EX_SOFTWARE, error.what());
}

// traction-view: the viewer's bridge.
#include "client/files/failure.h"
#include "client/show/output.h"
#include "client/viewer/arguments.h"

#include <sysexits.h>

#include <iostream>

namespace {

using namespace traction;

int fail(int exitCode, const std::string& what) {
  std::cerr << "traction-view: " << what << '\n';
  return exitCode;
}

}  // namespace

int main(int argc, char** argv) try {
  const auto arguments = view::parseArguments(argc, argv);
  if (!arguments) return arguments.error();
  client::rememberOutputErrors();  // a recording at a file size limit ends, and not the program
  view::serve(arguments->server, arguments->sources,
              [](const std::string& url) { std::cout << "traction-view: " << url << std::endl; });
  return EX_OK;
} catch (const client::Failure& error) {
  return fail(error.exitCode(), error.what());
} catch (const Error& error) {
  return fail(error.code() == ErrorCode::kBadKeys ? EX_CONFIG : EX_USAGE, error.what());
} catch (const std::exception& error) {
  return fail(EX_SOFTWARE, error.what());
}

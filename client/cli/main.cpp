// tractionctl: the command line of a running tractiond.

#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/show/output.h"
#include "manual/parse.h"

namespace {

using namespace traction::client;

constexpr auto kCommands = {addWatch,   addTop,      addEcho,       addTouch,  addStatus,
                            addMetrics, addSnapshot, addDescribe,   addZero,   addCalibrate,
                            addCamera,  addKeys,     addRecordings, addDoctor, addTrigger};

}  // namespace

int main(int argc, char** argv) try {
  rememberOutputErrors();
  CLI::App app("Shows and controls a running tractiond.", "tractionctl");
  app.set_version_flag("--version", "tractionctl " TRACTION_VERSION);
  app.require_subcommand(0, 1);  // Commands reports a missing command: the parser would, before a wrong word
  app.fallthrough();
  app.footer(kExitCodes);
  const Target target(app);
  Commands commands(app);
  for (const auto add : kCommands) add(commands);

  const auto parsed = manual::parse(app, argc, argv);
  const int exitCode = parsed ? commands.run(target) : parsed.error();
  flushOutput();
  return exitCode;
} catch (const std::exception& error) {
  return traction::client::fail(error);
}

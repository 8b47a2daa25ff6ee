// tractionctl: the command line of a running tractiond.

#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/parsing.h"
#include "client/show/output.h"
#include "manual/describe.h"

#include <sysexits.h>

#include <sstream>

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
  app.require_subcommand(0, 1);  // a missing command is an error below: the parser would report it before a wrong word
  app.fallthrough();
  app.footer(kExitCodes);
  manual::describable(app);
  const Target target(app);
  Commands commands(app);
  for (const auto add : kCommands) add(commands);

  const std::vector<std::string> words = wordsOf(argc, argv);
  try {
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));  // the parser takes them in reverse order
    const int exitCode = commands.run(target);
    flushOutput();
    return exitCode;
  } catch (const CLI::Success& done) {  // help, version
    std::ostringstream text;
    app.exit(done, text, text);
    printLine(text.str().substr(0, text.str().find_last_not_of('\n') + 1));
    return EX_OK;
  } catch (const CLI::ParseError& error) {
    return fail(EX_USAGE, sentence(error, app, words));
  }
} catch (const std::exception& error) {
  return traction::client::fail(error);
}

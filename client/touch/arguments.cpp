#include "client/touch/arguments.h"

#include "client/touch/source.h"
#include "manual/parse.h"

#include <CLI/CLI.hpp>

namespace traction::contacts {
namespace {

constexpr const char* kExitCodes = R"(Exit codes (sysexits.h):
   0  stopped as asked
  64  the command line is wrong
  66  the file of the key, or of the hand, cannot be read
  69  an address is in use
  71  the operating system refuses something
  73  a directory or socket cannot be made
  75  another traction-touch has this instance
  77  no permission
  78  the file of the key, or of the hand, is wrong)";

}  // namespace

tl::expected<Arguments, int> parseArguments(int argc, char** argv) {
  Arguments arguments;
  SourceWords words;
  CLI::App app(
      "Follows the contacts of a tractiond from frame to frame, or joins several to a hand, and publishes that.",
      "traction-touch");
  CLI::Option* hand =
      app.add_option("--hand", arguments.hand,
                     "file of a hand: joins the fields of its fingers, instances on this machine, to grasps; the "
                     "sockets have the name of the hand")
          ->type_name("FILE");
  addSource(app, words, "name of a tractiond on this machine, and of the sockets", hand);
  app.add_option("--runtime", arguments.runtime, "directory of the sockets")->type_name("DIR");
  app.set_version_flag("--version", "traction-touch " TRACTION_VERSION);
  app.footer(kExitCodes);
  if (const auto parsed = manual::parse(app, argc, argv); !parsed) return tl::unexpected(parsed.error());
  arguments.source = sourceOf(words);
  return arguments;
}

}  // namespace traction::contacts

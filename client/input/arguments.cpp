#include "client/input/arguments.h"

#include "client/touch/source.h"
#include "manual/parse.h"

#include <CLI/CLI.hpp>
#include <sysexits.h>

#include <iostream>

namespace traction::input {
namespace {

constexpr const char* kExitCodes = R"(Exit codes (sysexits.h):
   0  stopped as asked, or the profile is right
  64  the command line is wrong
  66  the profile, or the file of the key, cannot be read
  69  the kernel has no uinput, or another program serves the socket of 3-D mice
  71  the operating system refuses something
  73  the socket of 3-D mice cannot be made
  77  no permission to make input devices
  78  the profile, or the file of the key, is wrong)";

}  // namespace

tl::expected<Arguments, int> parseArguments(int argc, char** argv) {
  Arguments arguments;
  contacts::SourceWords words;
  CLI::App app("Makes the gel of a tractiond a mouse, a touch screen, a pen, a keyboard for strokes, a 3-D mouse or a "
               "controller for music and art.",
               "traction-input");
  auto* const profile =
      app.add_option("--profile", arguments.profile,
                     "what to use it as: mouse, touch, tablet, strokes, puck, zoom, music; or a TOML file")
          ->type_name("NAME|FILE");
  auto* const teach = app.add_option("--teach", arguments.taught,
                                     "prints what is drawn as strokes of this symbol, for the file of an alphabet")
                          ->type_name("SYMBOL")
                          ->excludes(profile);
  app.add_flag("--digits", arguments.areDigits, "what is taught is read after the stroke of digits")->needs(teach);
  app.add_flag("--check", arguments.checks, "only checks the profile");
  contacts::addSource(app, words, "name of a tractiond on this machine", nullptr);
  app.set_version_flag("--version", "traction-input " TRACTION_VERSION);
  app.footer(kExitCodes);
  if (const auto parsed = manual::parse(app, argc, argv); !parsed) return tl::unexpected(parsed.error());
  if (arguments.profile.empty() && arguments.taught.empty()) {
    std::cerr << "traction-input: --profile is missing, or --teach; see traction-input --help\n";
    return tl::unexpected(EX_USAGE);
  }
  arguments.source = contacts::sourceOf(words);
  return arguments;
}

}  // namespace traction::input

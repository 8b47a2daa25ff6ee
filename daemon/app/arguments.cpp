#include "daemon/app/arguments.h"

#include "manual/number.h"
#include "manual/parse.h"

#include <CLI/CLI.hpp>

namespace tractiond {
namespace {

constexpr const char* kExitCodes = R"(Exit codes (sysexits.h):
   0  stopped as asked
  64  the command line is wrong
  65  an influence file, a recording, or a file in the state directory, is damaged or belongs to another sensor
  66  a file cannot be read
  69  no camera, or an address is in use
  70  a bug: the account of the frames does not balance
  71  the operating system refuses something
  73  a directory or file cannot be created
  74  a recording cannot be written to its end
  75  the camera or a directory is in use by another process
  76  a recording is of a newer version
  77  no permission
  78  the configuration is wrong)";

}  // namespace

tl::expected<Arguments, int> parseArguments(int argc, char** argv) {
  Arguments arguments;
  Places& places = arguments.places;
  CLI::App app("Surface traction fields from a camera that looks into a gel.", "tractiond");
  app.add_option("--instance", places.instance, "name of one of several daemons on a machine")
      ->type_name("INSTANCE")
      ->capture_default_str();
  app.add_option("--config", places.config, "configuration file; default /etc/tractiond/INSTANCE.toml if it is there")
      ->type_name("FILE");
  app.add_option("--state", places.state, "directory of the zero and of what is computed once")->type_name("DIR");
  app.add_option("--runtime", places.runtime, "directory of the sockets")->type_name("DIR");
  app.add_flag("--check-config", arguments.checkConfig, "check the configuration and the gel file, and exit");
  app.add_flag("--print-config", arguments.printConfig, "print the configuration with every key, and exit");
  app.add_flag("--cameras", arguments.listCameras, "list the cameras in sight and what keeps them, and exit");
  app.add_option("--plan", arguments.description, "say what would be done with a camera of this GenICam file, and exit")
      ->type_name("FILE");
  app.add_option("--inspect", arguments.inspected)->group("");  // what tractiond asks of itself: not for people
  app.add_option("--inspect-gel", arguments.inspectedGel)->group("");
  app.add_flag("--limited", arguments.limited)->group("");
  app.add_option("--images", arguments.images, "raw pictures from a file (-: standard input) instead of a camera")
      ->type_name("FILE");
  app.add_option("--record", arguments.record.file,
                 "record pictures and forces in a new file, so that --replay can compute them again")
      ->type_name("FILE");
  app.add_option("--record-hz", arguments.record.rate_Hz, "of pictures, at most; 0: each that is tracked")
      ->type_name("HZ")
      ->capture_default_str()
      ->check(manual::number(0.0, 1e6));
  app.add_flag("--record-packed", arguments.record.packed, "with pictures compressed, without a loss");
  auto* const replay = app.add_option("--replay", arguments.replay.file,
                                      "compute the forces of a recording again and publish them; with the gel, [track] "
                                      "and [solve] of --config where it is given, else with the recording's");
  replay->type_name("FILE")->excludes("--images");
  app.add_option("--replay-rate", arguments.replay.rate, "times as fast as it was; 0: as fast as possible")
      ->type_name("FACTOR")
      ->capture_default_str()
      ->check(manual::number(0.0, 1e6));
  app.set_version_flag("--version", std::string("tractiond " TRACTIOND_VERSION));
  app.footer(kExitCodes);
  if (const auto parsed = manual::parse(app, argc, argv); !parsed) return tl::unexpected(parsed.error());
  arguments.replay.ownGel = !places.config.empty();
  return arguments;
}

}  // namespace tractiond

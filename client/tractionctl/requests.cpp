// status, metrics, snapshot, describe, zero and trigger: one request each.

#include "client/cli/camera.h"
#include "client/cli/commands.h"
#include "client/cli/metrics.h"
#include "client/tractionctl/commands.h"
#include "client/tractionctl/exit_codes.h"

#include <sysexits.h>

#include <algorithm>
#include <cctype>
#include <memory>
#include <string>

namespace traction::cli {

void addStatus(Commands& commands) {
  const auto json = std::make_shared<bool>(false);
  commands
      .add("status", "Prints the state of the daemon, and the account of all frames",
           [json](const Target& target) { return status(target.control(), *json), EX_OK; })
      .add_flag("--json", *json, "as JSON");
}

void addMetrics(Commands& commands) {
  const auto http = std::make_shared<bool>(false);
  commands
      .add("metrics",
           "Prints the state of the daemons on this machine as Prometheus reads it; with --instance or --control, of "
           "one",
           [http](const Target& target) {
             const ControlOptions control = target.control();
             metrics(control, target.isInstanceNamed() || !control.endpoint.empty(), *http);
             return EX_OK;
           })
      .add_flag("--http", *http, "as the answer to the HTTP request on standard input (traction-metrics.socket)");
}

/// Returns the name with ".png" if it ends as that of a picture of another type; else an empty text.
std::string asPng(const std::string& path) {
  const std::size_t dot = path.rfind('.');
  if (dot == std::string::npos || path.find('/', dot) != std::string::npos) return "";
  std::string type = path.substr(dot + 1);
  std::ranges::transform(type, type.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const char* other : {"jpg", "jpeg", "tif", "tiff", "bmp", "gif", "webp", "pgm", "ppm", "raw"}) {
    if (type == other) return path.substr(0, dot) + ".png";
  }
  return "";
}

void addSnapshot(Commands& commands) {
  struct Options {
    std::string path;
    bool marked = false;
  };
  const auto options = std::make_shared<Options>();
  CLI::App& command =
      commands.add("snapshot", "Writes the camera's next picture as a PNG file", [options](const Target& target) {
        if (std::string png = asPng(options->path); !png.empty()) {
          return fail(EX_USAGE, "snapshot writes PNG files: name it " + png);
        }
        return snapshot(target.control(), options->path, options->marked), EX_OK;
      });
  command.add_option("file", options->path, "file to write; an existing one is replaced")
      ->type_name("FILE")
      ->required();
  command.add_flag("--marked", options->marked,
                   "draws rings in their colour around the markers found, crosses where they are lost, small dots "
                   "where the gel file has them, and squares around other spots that look like markers");
}

void addDescribe(Commands& commands) {
  commands
      .add("describe", "Prints the sensor's description as JSON",
           [](const Target& target) { return describe(target.control()), EX_OK; })
      .add_flag("--json")
      ->description("has no effect: the output is JSON");
}

void addZero(Commands& commands) {
  const auto options = std::make_shared<ZeroCommand>();
  CLI::App& command = commands.add("zero", "Takes the next pictures as those of the unloaded gel",
                                   [options](const Target& target) { return zero(target.control(), *options), EX_OK; });
  auto* anyway = command.add_flag("--anyway", options->anyway, "proceeds even if something seems to touch the gel");
  command.add_flag("--undo", options->undo, "restores the previous zero instead")->excludes(anyway);
  command.add_flag("--json", options->json, "as JSON");
}

void addTrigger(Commands& commands) {
  commands.add("trigger", "Triggers one picture, if the camera's trigger is set to software",
               [](const Target& target) { return trigger(target.control()), EX_OK; });
}

}  // namespace traction::cli

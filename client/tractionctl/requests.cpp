// status, metrics, snapshot, describe, zero and trigger: one request each.

#include "client/cli/camera.h"
#include "client/cli/commands.h"
#include "client/cli/metrics.h"
#include "client/tractionctl/commands.h"

#include <sysexits.h>

#include <memory>

namespace traction::cli {

void addStatus(Commands& commands) {
  const auto json = std::make_shared<bool>(false);
  commands
      .add("status", "Tells how the daemon does, and where every frame went",
           [json](const Target& target) { return status(target.control(), *json), EX_OK; })
      .add_flag("--json", *json, "as JSON");
}

void addMetrics(Commands& commands) {
  const auto http = std::make_shared<bool>(false);
  commands
      .add("metrics",
           "Prints how the daemons of this machine do, as Prometheus reads it; with --instance or --control one alone",
           [http](const Target& target) {
             const ControlOptions control = target.control();
             metrics(control, target.isInstanceNamed() || !control.endpoint.empty(), *http);
             return EX_OK;
           })
      .add_flag("--http", *http, "as the answer to the HTTP request on standard input (traction-metrics.socket)");
}

void addSnapshot(Commands& commands) {
  struct Options {
    std::string path;
    bool marked = false;
  };
  const auto options = std::make_shared<Options>();
  CLI::App& command =
      commands.add("snapshot", "Writes what the camera sees now as a PNG file", [options](const Target& target) {
        return snapshot(target.control(), options->path, options->marked), EX_OK;
      });
  command.add_option("file", options->path, "to write; an old one is replaced")->type_name("FILE")->required();
  command.add_flag("--marked", options->marked,
                   "with rings in their colour around the markers found, crosses where they are lost, small dots where "
                   "the gel file has them, squares around whatever else looks like one");
}

void addDescribe(Commands& commands) {
  commands
      .add("describe", "Prints the sensor's description as JSON",
           [](const Target& target) { return describe(target.control()), EX_OK; })
      .add_flag("--json")
      ->description("as it is anyway");
}

void addZero(Commands& commands) {
  const auto options = std::make_shared<ZeroCommand>();
  CLI::App& command = commands.add("zero", "Takes what the camera sees now as the unloaded gel",
                                   [options](const Target& target) { return zero(target.control(), *options), EX_OK; });
  auto* anyway = command.add_flag("--anyway", options->anyway, "also if something seems to touch the gel");
  command.add_flag("--undo", options->undo, "restores the previous zero instead")->excludes(anyway);
  command.add_flag("--json", options->json, "as JSON");
}

void addTrigger(Commands& commands) {
  commands.add("trigger", "Triggers one picture, where the camera's trigger is set to software",
               [](const Target& target) { return trigger(target.control()), EX_OK; });
}

}  // namespace traction::cli

// Parses the arguments, runs what they ask for, and returns the exit code.
#include "base/service/service.h"
#include "daemon/app/arguments.h"
#include "daemon/app/camera_commands.h"
#include "daemon/app/config.h"
#include "daemon/app/gel_files.h"
#include "daemon/app/serve.h"
#include "daemon/capture/inspection.h"

#include <malloc.h>

#include <cstdlib>
#include <iostream>
#include <new>

namespace {

using namespace tractiond;

int checkConfig(const Config& config) {  // completed()
  const auto gel = loadGel(config.sensor.gelFile);
  return gel ? EX_OK : failed(gel.error());
}

}  // namespace

int main(int argc, char** argv) try {
  mallopt(M_ARENA_MAX, 1);  // of a thread's own heap the C library gives nothing back that is free at its end
  const auto arguments = parseArguments(argc, argv);
  if (!arguments) return arguments.error();
  if (!arguments->inspected.empty()) return capture::printInspection(arguments->inspected);
  if (!arguments->inspectedGel.empty()) return printGelCheck(arguments->inspectedGel);
  if (arguments->limited) capture::limitChild();
  const auto places = located(arguments->places);
  if (!places) return failed(places.error());
  const auto config = configured(*arguments, *places);
  if (!config) return failed(config.error());
  if (arguments->printConfig) return std::cout << configText(*config), EX_OK;
  if (!arguments->description.empty()) {
    return arguments->limited ? planCamera(arguments->description, config->camera)
                              : planCameraInChild(argc, argv, arguments->description);
  }
  if (arguments->listCameras) return listCameras(config->camera);
  if (!arguments->replay.file.empty() && !arguments->checkConfig) return replayRecording(*arguments, *config, *places);
  return arguments->checkConfig ? checkConfig(completed(*config, *places)) : serve(*arguments, *config, *places, argv);
} catch (const std::bad_alloc&) {
  return failed({.exitCode = EX_OSERR, .what = "there is no memory left", .remedy = "see MemoryMax= of the service"});
} catch (const std::exception& error) {
  return failed({.exitCode = EX_OSERR, .what = error.what()});
}

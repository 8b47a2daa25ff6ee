#include "daemon/app/camera_commands.h"

#include "daemon/app/serve.h"
#include "daemon/capture/camera_list.h"
#include "daemon/capture/camera_plan.h"
#include "daemon/capture/inspection.h"

#include <spdlog/fmt/fmt.h>

#include <iostream>
#include <vector>

namespace tractiond {

int listCameras(const capture::CameraOptions& options) {
  const auto sights = capture::inspectCameras(options.inspector, options.fakeInterface);
  if (sights.empty()) std::cerr << "tractiond: no camera answers; " << capture::kWhatToCheck << "\n";
  for (const auto& [camera, obstacle, remedy, notes] : sights) {
    std::cout << camera.vendor << "-" << camera.serial << "  " << camera.model << "  " << camera.address << "  "
              << camera.physicalId << "  " << camera.protocol << "\n";
    if (!obstacle.empty())
      std::cout << "  cannot be opened: " << obstacle << (remedy.empty() ? "" : "; ") << remedy << "\n";
    for (const std::string& note : notes) std::cout << "  " << note << "\n";
  }
  return EX_OK;
}

int planCamera(const std::string& file, const capture::CameraOptions& options) {
  const auto plan = capture::planCamera(file, options);
  if (!plan) return failed(plan.error());
  const auto list = [](const std::vector<std::string>& items) {
    return items.empty() ? std::string("none") : fmt::format("{}", fmt::join(items, ", "));
  };
  const std::string format = plan->format.empty() ? "the camera's own, or else the first that it has" : plan->format;
  std::cout << plan->vendor << " " << plan->model << "\n  format    " << format << " of " << list(plan->formats)
            << "\n  rate      " << plan->rate << "\n  exposure  " << plan->exposure << "\n  gain      " << plan->gain
            << "\n  triggers  " << plan->trigger << "\n  PTP       " << plan->clock << "\n  chunks    " << plan->chunks
            << "\n  link      " << plan->link << "\n  set       " << list(plan->settings) << "\n";
  for (const std::string& note : plan->notes) std::cout << "  note      " << note << "\n";
  std::cout << "  note      the file describes a family: one model may have fewer formats, triggers and features\n";
  return EX_OK;
}

int planCameraInChild(int argc, char** argv, const std::string& file) {
  std::vector<std::string> words(argv + 1, argv + argc);
  words.emplace_back("--limited");
  const ChildEnd end = runChild(words, {});
  if (const std::string what = capture::misdeed(end); !what.empty())
    return failed({.exitCode = EX_DATAERR, .what = "the description " + what, .where = file});
  std::cout << end.output;
  std::cerr << end.errors;
  return end.code;
}

}  // namespace tractiond

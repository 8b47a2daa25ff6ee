#include "client/cli/camera.h"

#include "client/tractionctl/commands.h"
#include "client/tractionctl/exit_codes.h"

#include <sysexits.h>

#include <memory>
#include <utility>

namespace traction::cli {

namespace {

struct CameraLine {
  CLI::App *camera = nullptr, *list = nullptr, *get = nullptr, *set = nullptr, *run = nullptr, *white = nullptr,
           *temperature = nullptr;
  bool json = false;
  std::string part;
  std::vector<std::string> categories, words;
};

int run(const CameraLine& given, const ControlOptions& control) {
  if (given.camera->get_subcommands().empty()) return cameraSummary(control, given.json), EX_OK;
  for (const auto& [command, example] :
       {std::pair{given.get, "ExposureTime"}, {given.set, "ExposureTime=4000"}, {given.run, "UserSetLoad"}}) {
    if (!command->parsed() || !given.words.empty()) continue;
    return fail(EX_USAGE,
                "missing feature name, for example: tractionctl camera " + command->get_name() + " " + example);
  }
  std::vector<CameraStep> steps;
  for (const std::string& word : given.words) {
    CameraStep step;
    step.kind = given.get->parsed() ? CameraStep::Kind::kRead : CameraStep::Kind::kExecute;
    step.name = word;
    if (given.set->parsed()) {
      const auto write = parseWrite(word);
      if (!write) return fail(EX_USAGE, "'" + word + "' is not NAME=VALUE, for example: " + asWrites(given.words));
      step = *write;
    }
    steps.push_back(step);
  }
  if (steps.empty()) steps.emplace_back();
  if (given.list->parsed()) {
    steps[0].matching = given.part;
    steps[0].categories = given.categories;
  }
  if (given.temperature->parsed()) steps[0].matching = "temperature";
  if (given.white->parsed()) steps[0].kind = CameraStep::Kind::kBalanceWhite;
  return camera(control, steps, given.json), EX_OK;
}

}  // namespace

void addCamera(Commands& commands) {
  const auto options = std::make_shared<CameraLine>();
  CLI::App& camera = commands.add("camera",
                                  "Reads and changes the camera's features while it runs; without a command: those "
                                  "that are configured or were changed, and the temperature",
                                  [options](const Target& target) { return run(*options, target.control()); });
  options->camera = &camera;
  options->list = camera.add_subcommand("list", "Lists features with their values and ranges");
  options->get = camera.add_subcommand("get", "Prints everything about some features");
  options->set = camera.add_subcommand("set", "Writes features");
  options->run = camera.add_subcommand("run", "Runs commands of the camera, and waits for their end");
  options->white =
      camera.add_subcommand("white", "Balances white once, so that the present picture is grey on average");
  options->temperature = camera.add_subcommand("temperature", "Prints the camera's temperatures");
  camera.require_subcommand(0, 1);
  camera.add_flag("--json", options->json, "as JSON");
  camera.footer(
      "A change lasts until the camera is opened again. A permanent setting belongs in [camera] of the configuration.");
  options->list->add_option("part", options->part, "part of their names, in upper or lower case; without it: all");
  options->list
      ->add_option("--category", options->categories, "category, for example AnalogControl; may be given several times")
      ->type_name("NAME");
  options->get->add_option("names", options->words, "features, for example: ExposureTime BalanceRatio[Red]");
  options->set->add_option("changes", options->words,
                           "values, written one after another, for example: ExposureTime=4000");
  options->run->add_option("names", options->words, "commands, run one after another");
  for (CLI::App* one : camera.get_subcommands([](const CLI::App*) { return true; }))
    one->add_flag("--json", options->json, "as JSON");
}

}  // namespace traction::cli

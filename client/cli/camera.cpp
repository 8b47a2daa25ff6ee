// Reads and changes the camera's features.
#include "base/printable.h"
#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/show/json.h"
#include "client/show/output.h"
#include "traction/control.h"

#include <sysexits.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace traction::client {

namespace {

using Access = CameraFeature::Access;
using Kind = CameraFeature::Kind;

constexpr std::size_t kWidestValue = 28;

std::optional<double> asNumber(const std::string& text) {
  double number = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

/// Returns whether two texts are the same number, such as "4000" and "4000.0".
bool isSame(const std::string& one, const std::string& other) {
  if (one == other) return true;
  const auto a = asNumber(one), b = asNumber(other);
  return a && b && std::abs(*a - *b) <= 1e-9 * std::max(std::abs(*a), std::abs(*b));
}

std::string text(double number) {
  std::array<char, 32> digits{};
  return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr};
}

std::string valueOf(const CameraFeature& feature) {
  if (feature.kind == Kind::kCommand) return "(command)";
  if (feature.kind == Kind::kRegister) return "(bytes)";
  if (feature.access == Access::kNone) return "(not available)";
  if (feature.value.empty()) return feature.kind == Kind::kString ? "\"\"" : "(unreadable)";
  return printable(feature.unit.empty() ? feature.value : feature.value + " " + feature.unit);
}

const char* accessOf(const CameraFeature& feature) {
  constexpr std::array<const char*, 4> kWords = {"--", "r-", "-w", "rw"};
  return kWords[static_cast<std::size_t>(feature.access)];
}

std::string rangeOf(const CameraFeature& feature) {
  std::string words;
  for (const std::string& entry : feature.entries) words += (words.empty() ? "" : " | ") + printable(entry);
  if (feature.minimum || feature.maximum) {
    words = (feature.minimum ? text(*feature.minimum) : "") + " to " + (feature.maximum ? text(*feature.maximum) : "");
    if (feature.increment && *feature.increment != 1.0) words += " by " + text(*feature.increment);
  }
  return words;
}

/// Returns how the value differs from the configuration, or from before the session's first write; empty: not at all.
std::string changeOf(const CameraFeature& feature) {
  const auto differs = [&](const std::string& from) { return !from.empty() && !isSame(feature.value, from); };
  if (differs(feature.configured)) return "config: " + printable(feature.configured);
  return differs(feature.first) ? "was: " + printable(feature.first) : "";
}

std::string nameOf(const CameraFeature& feature) {
  std::string name = printable(feature.name);
  for (const std::string& choice : feature.selected) name += " [" + printable(choice) + "]";
  return name;
}

std::string padded(std::string text, std::size_t width) {
  const auto shown = static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }));
  if (shown < width) text.append(width - shown, ' ');
  return text;
}

std::string block(const CameraFeature& feature) {
  std::string lines;
  const auto line = [&](const char* name, const std::string& value) {
    if (!value.empty()) lines += "  " + padded(name, 12) + printable(value) + "\n";
  };
  lines += (changeOf(feature).empty() ? "" : "* ") + nameOf(feature) + " = " + valueOf(feature) + "\n";
  line("is", feature.description);
  line("range", feature.entries.empty() ? rangeOf(feature) : "");
  line("entries", feature.entries.empty() ? "" : rangeOf(feature));
  constexpr std::array<const char*, 4> kWords = {"not now", "read", "write", "read and write"};
  line("access", kWords[static_cast<std::size_t>(feature.access)]);
  line("configured", feature.configured);
  line("at first", feature.first);
  line("category", feature.category);
  return lines;
}

void append(CameraReport& report, CameraReport&& more) {
  for (CameraFeature& feature : more.features) {
    const auto known = std::find_if(report.features.begin(), report.features.end(), [&](const CameraFeature& other) {
      return other.name == feature.name && other.selected == feature.selected;
    });
    if (known == report.features.end()) {
      report.features.push_back(std::move(feature));
    } else {
      *known = std::move(feature);  // the later look
    }
  }
  report.remarks.insert(report.remarks.end(), more.remarks.begin(), more.remarks.end());
  report.camera = std::move(more.camera);
}

/// Returns a table whose lines end with a newline: a block of lines for a single feature, one line per feature for
/// several, below the names of their categories; empty without features. Marks with '*' values that differ from the
/// configuration or from before the session's first write. What is not printable becomes '?'.
std::string table(const CameraReport& report) {
  if (report.features.size() == 1) return block(report.features[0]);
  std::size_t nameWidth = 0, valueWidth = 0;
  for (const CameraFeature& feature : report.features) {
    nameWidth = std::max(nameWidth, nameOf(feature).size());
    valueWidth = std::max(valueWidth, std::min(valueOf(feature).size(), kWidestValue));
  }
  std::string lines, category;
  for (const CameraFeature& feature : report.features) {
    if (feature.category != category) {
      category = feature.category;
      lines += (lines.empty() ? "" : "\n") + printable(category) + "\n";
    }
    std::string line = changeOf(feature).empty() ? "  " : "* ";
    line += padded(nameOf(feature), nameWidth) + "  " + padded(valueOf(feature), valueWidth) + "  " + accessOf(feature);
    for (const std::string& more : {changeOf(feature), rangeOf(feature)}) {
      if (!more.empty()) line += "  " + more;
    }
    lines += line + "\n";
  }
  return lines;
}

void print(const CameraReport& report, bool json) {
  if (json) {
    printLine(toJson(report));
    return;
  }
  std::string lines = table(report);
  for (const std::string& remark : report.remarks) lines += "note: " + printable(remark) + "\n";
  if (!lines.empty()) printLines(lines.substr(0, lines.size() - 1));
}

/// Carries out the steps in order and prints their reports together, as a table or one line of JSON; of a feature that
/// several report, only the last state. Without features and remarks, the text is "done", or that no feature matches.
/// If a step fails, later steps are not sent: the reports of the steps before it are printed, and its error is thrown
/// with the feature's name; the error of the first step is thrown as it is.
/// \throws Error, OutputError
void camera(const ControlOptions& control, const std::vector<CameraStep>& steps, bool json) {
  const Control daemon(control);
  CameraReport report;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    try {
      append(report, daemon.camera(steps[i]));
    } catch (const Error& error) {
      if (i == 0) throw;
      print(report, json);
      std::string words = error.what();
      words.insert(0, steps[i].name + ": ").append("; what stands before it was done");
      throw Error(error.code(), words);
    }
  }
  print(report, json);
  if (json || !report.features.empty() || !report.remarks.empty()) return;
  printLine(steps.size() == 1 && steps[0].kind == CameraStep::Kind::kList ? "no feature of the camera matches"
                                                                          : "done");
}

/// Prints the features that the configuration sets or that were written, and the camera's temperatures: as a table
/// below a line with the camera's name and its number of features, or as one line of JSON.
/// \throws Error, OutputError
void cameraSummary(const ControlOptions& control, bool json) {
  CameraReport report = Control(control).camera({});
  const std::size_t all = report.features.size();
  const auto isBoring = [](const CameraFeature& feature) {
    const bool isWarmth =
        feature.name.find("Temperature") != std::string::npos && !feature.value.empty() && feature.kind == Kind::kFloat;
    return feature.configured.empty() && feature.first.empty() && !isWarmth;
  };
  report.features.erase(std::remove_if(report.features.begin(), report.features.end(), isBoring),
                        report.features.end());
  if (json) return print(report, json);
  printLine(report.camera + ": " + std::to_string(all) +
            " features (tractionctl camera list); configured, changed or telling a temperature are");
  print(report, json);
}

struct CameraLine {
  CLI::App *camera = nullptr, *list = nullptr, *get = nullptr, *set = nullptr, *run = nullptr, *white = nullptr,
           *temperature = nullptr;
  bool json = false;
  std::string part;
  std::vector<std::string> categories, words;
};

int run(const CameraLine& given, const ControlOptions& control) {
  if (given.camera->get_subcommands().empty()) return cameraSummary(control, given.json), EX_OK;
  std::vector<CameraStep> steps;
  for (const std::string& word : given.words) {
    CameraStep step;
    step.kind = given.get->parsed() ? CameraStep::Kind::kRead : CameraStep::Kind::kExecute;
    step.name = word;
    if (given.set->parsed()) {
      const std::size_t sign = word.find('=');
      if (sign == 0 || sign == std::string::npos)
        return fail(EX_USAGE, "'" + word + "' is not NAME=VALUE, for example: ExposureTime=4000");
      step.kind = CameraStep::Kind::kWrite;
      step.name = word.substr(0, sign);
      step.value = word.substr(sign + 1);
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
  options->get->add_option("names", options->words, "features, for example: ExposureTime BalanceRatio[Red]")
      ->required();
  options->set
      ->add_option("changes", options->words, "values, written one after another, for example: ExposureTime=4000")
      ->required();
  options->run->add_option("names", options->words, "commands, run one after another")->required();
  for (CLI::App* one : camera.get_subcommands([](const CLI::App*) { return true; }))
    one->add_flag("--json", options->json, "as JSON");
}

}  // namespace traction::client

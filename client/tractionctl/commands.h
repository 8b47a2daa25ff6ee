// The commands of tractionctl: each adds itself to the command line.
#pragma once

#include "client/tractionctl/target.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

namespace traction::cli {

/// Carries out a command, and blocks until it is done. Returns an exit code: of sysexits.h, or that of doctor.
/// \throws Error, KeyError, NoField, OutputError or RecordingError
using Run = std::function<int(const Target& target)>;

/// The commands, in the order in which --help lists them. Thread-bound.
class Commands {
 public:
  /// \param app command line to which the commands are added; must outlive the object
  explicit Commands(CLI::App& app)
      : app_(app) {}

  /// Adds a command, and returns it for its options; the result lives as long as the command line. The values of these
  /// must live as long as `run`. \param name must differ from those of the other commands
  CLI::App& add(const std::string& name, const std::string& help, Run run) {
    commands_.push_back({app_.add_subcommand(name, help), std::move(run)});
    return *commands_.back().app;
  }

  /// Carries out the command that the parsed command line names. Returns its exit code, and throws what it throws.
  /// Requires that the command line names one.
  int run(const Target& target) const {
    const auto given = std::ranges::find_if(commands_, [](const Command& one) { return one.app->parsed(); });
    return given->run(target);
  }

 private:
  struct Command {
    CLI::App* app;
    Run run;
  };
  CLI::App& app_;
  std::vector<Command> commands_;
};

// Each function adds the command of its name, with its options, to the command line.
void addWatch(Commands& commands);
void addTop(Commands& commands);
void addEcho(Commands& commands);
void addStatus(Commands& commands);
void addMetrics(Commands& commands);
void addSnapshot(Commands& commands);
void addDescribe(Commands& commands);
void addZero(Commands& commands);
void addCalibrate(Commands& commands);
void addCamera(Commands& commands);
void addKeys(Commands& commands);
void addRecordings(Commands& commands);  ///< adds record, replay, info, recover and export
void addDoctor(Commands& commands);
void addTrigger(Commands& commands);

}  // namespace traction::cli

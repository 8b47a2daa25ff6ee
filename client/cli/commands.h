// The commands of tractionctl: each adds itself to the command line.
#pragma once

#include "client/cli/exit_codes.h"
#include "client/cli/target.h"
#include "manual/number.h"

#include <CLI/CLI.hpp>
#include <sysexits.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace traction::client {

/// Carries out a command, and blocks until it is done. Returns an exit code: of sysexits.h, or that of doctor.
/// \throws Error, Failure or OutputError
using Run = std::function<int(const Target& target)>;

/// The commands, in the order in which --help lists them. Thread-bound.
class Commands {
 public:
  /// \param app command line to which the commands are added; must outlive the object
  explicit Commands(CLI::App& app)
      : app_(app) {}

  /// Adds a command, and returns it for its options; the result lives as long as the command line. The variables that
  /// the options fill must live as long as the command line.
  /// \param name must differ from those of the other commands
  /// \param help one line for --help
  /// \param run called by run() if the command line names this command
  CLI::App& add(const std::string& name, const std::string& help, Run run) {
    commands_.push_back({app_.add_subcommand(name, help), std::move(run)});
    return *commands_.back().app;
  }

  /// Carries out the command that the parsed command line names. Returns its exit code, and throws what it throws.
  /// Prints an error and returns EX_USAGE if it names none.
  int run(const Target& target) const {
    const auto given = std::ranges::find_if(commands_, [](const Command& one) { return one.app->parsed(); });
    if (given == commands_.end()) return fail(EX_USAGE, "a command is needed; see tractionctl --help");
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

/// Returns the path of a program beside this one; without it, its name, by which PATH has it.
inline std::string programBeside(const std::string& name) {
  std::error_code unknown;
  const auto beside = std::filesystem::read_symlink("/proc/self/exe", unknown).replace_filename(name);
  return std::filesystem::exists(beside, unknown) ? beside.string() : name;
}

/// Returns a check for a duration from 0 to 10^9 s.
inline CLI::Validator timeSpan() {
  return manual::number(0.0, 1e9, "a time from 0 to 1e9 s, as in 2.5");
}

/// Duration of a command that ends on a signal only [s].
inline constexpr double kForever = std::numeric_limits<double>::infinity();

/// Adds the option --seconds to a command that otherwise runs until a key or a signal ends it.
inline void addSeconds(CLI::App& command, double& seconds) {
  command.add_option("--seconds", seconds, "duration; without it: until q or Ctrl-C")
      ->type_name("SECONDS")
      ->check(timeSpan());
}

// Each function adds the command of its name, with its options, to the command line; the comment says what the command
// does. Called once each, before the command line is parsed.
void addWatch(Commands& commands);       ///< shows the forces live
void addTop(Commands& commands);         ///< shows the state of instruments live
void addEcho(Commands& commands);        ///< prints messages as JSON, one per line
void addTouch(Commands& commands);       ///< prints contacts as they begin, last and end
void addStatus(Commands& commands);      ///< prints the daemon's state and the ledger
void addMetrics(Commands& commands);     ///< prints the state of daemons in Prometheus's format
void addSnapshot(Commands& commands);    ///< writes the camera's next picture as a PNG file
void addDescribe(Commands& commands);    ///< prints the description as JSON
void addZero(Commands& commands);        ///< takes a zero, or restores the previous one
void addCalibrate(Commands& commands);   ///< runs steps of a calibration
void addCamera(Commands& commands);      ///< has subcommands that read and change the camera's features
void addKeys(Commands& commands);        ///< has subcommands for files of keys: new, allow, revoke, list
void addRecordings(Commands& commands);  ///< adds five commands: record, replay, info, recover and export
void addDoctor(Commands& commands);      ///< examines this machine
void addTrigger(Commands& commands);     ///< sends the camera one software trigger

}  // namespace traction::client

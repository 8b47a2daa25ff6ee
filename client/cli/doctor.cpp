#include "client/cli/commands.h"
#include "client/doctor/checks.h"
#include "client/show/output.h"

#include <memory>
#include <string>

namespace traction::client {

namespace {

/// Examines this machine. Returns doctor::exitCodeOf().
/// \param instance the only one to examine; empty: all
int run(const std::string& instance, bool json) {
  const auto findings = doctor::examine(doctor::Box(), programBeside("tractiond"), instance);
  std::string text = json ? doctor::reportJson(findings) : doctor::reportText(findings);
  if (text.back() == '\n') text.pop_back();
  printLines(text);
  return doctor::exitCodeOf(findings);
}

}  // namespace

void addDoctor(Commands& commands) {
  const auto json = std::make_shared<bool>(false);
  CLI::App& command = commands.add(
      "doctor", "Examines this machine, and prints what is wrong with it and the command that mends it",
      [json](const Target& target) { return run(target.isInstanceNamed() ? target.instance() : "", *json); });
  command.add_flag("--json", *json, "as JSON");
  command.footer("Exit codes: 0 if nothing is found wrong, 1 after warnings, 2 if a check fails. Needs no root; what "
                 "it may not read is reported as not known.");
}

}  // namespace traction::client

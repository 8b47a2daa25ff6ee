#include "client/cli/parsing.h"

#include "manual/number.h"

namespace traction::client {

CLI::Validator timeSpan() {
  return manual::number(0.0, 1e9, "a time from 0 to 1e9 s, as in 2.5");
}

void addSeconds(CLI::App& command, double& seconds) {
  command.add_option("--seconds", seconds, "duration; without it: until q or Ctrl-C")
      ->type_name("SECONDS")
      ->check(timeSpan());
}

}  // namespace traction::client

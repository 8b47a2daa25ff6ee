#include "client/cli/commands.h"

#include "client/cli/health.h"
#include "client/cli/json.h"
#include "client/cli/output.h"
#include "client/cli/status_text.h"
#include "client/src/printable.h"

#include <cstdio>

namespace traction::cli {

void status(const ControlOptions& options, bool json) {
  const Status status = Control(options).status();
  if (json) {
    printLine(toJson(status));
  } else {
    std::fputs(statusText(status).c_str(), stdout);
    flushOutput();
  }
  if (const std::string why = whyNoField(*status.message); !why.empty()) throw NoField("no field can come: " + why);
}

void describe(const ControlOptions& options) {
  printLine(toJson(Control(options).description()));
}

void zero(const ControlOptions& options, const ZeroCommand& command) {
  const Control control(options);
  const ZeroResult result = command.undo ? control.undoZero() : control.zero({.anyway = command.anyway});
  if (command.json) {
    printLine(toJson(result));
    return;
  }
  std::printf("zero %s: %u of %u markers, pixel noise %.1f grey levels, id %s\n", command.undo ? "restored" : "taken",
              result.markersPresent, result.markersExpected, result.noise_levels, toHex(result.zero.id).c_str());
  if (!result.remark.empty()) std::printf("warning: %s\n", printable(result.remark).c_str());
}

}  // namespace traction::cli

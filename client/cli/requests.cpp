// status, metrics, describe, zero and trigger: one request each.
#include "base/printable.h"
#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/doctor/checks.h"
#include "client/files/failure.h"
#include "client/show/health.h"
#include "client/show/json.h"
#include "client/show/metrics.h"
#include "client/show/output.h"
#include "client/show/status_text.h"
#include "traction/control.h"

#include <sysexits.h>

#include <chrono>
#include <cstdio>
#include <iostream>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace traction::client {

namespace {

/// Reads the request up to its empty line. Closing a connection with unread bytes would cut the answer short.
void skipRequest() {
  constexpr std::size_t kMost = 16'384;
  std::size_t size = 0;
  for (std::string line; size < kMost && std::getline(std::cin, line) && !line.empty() && line != "\r";)
    size += line.size();
}

/// Prints the status, as text or as one line of JSON.
/// \throws Failure EX_NOINPUT after printing it, if no field can be published
void status(const ControlOptions& options, bool json) {
  const Status status = Control(options).status();
  if (json) {
    printLine(toJson(status));
  } else {
    std::fputs(statusText(status).c_str(), stdout);
    flushOutput();
  }
  if (const std::string why = whyNoField(*status.message); !why.empty())
    throw Failure(EX_NOINPUT, "no field can come: " + why);
}

/// Prints the metrics of one instance, or of all on this machine if `one` is false. An instance that gives no status,
/// for any reason, is reported as down, which is not an error. Asks one instance after another, and waits for each at
/// most `options.timeout`, with `one` false 1 s, to connect and as long again for the answer.
/// \param http true: waits for an HTTP request on standard input, reads it up to its empty line, and prints an answer
/// with the metrics whatever it asks for; for a socket unit of systemd
/// \throws OutputError
void metrics(const ControlOptions& options, bool one, bool http) {
  constexpr std::chrono::milliseconds kPatience(1000);
  if (http) skipRequest();
  std::vector<Measured> all;
  for (const std::string& name : one ? std::set<std::string>{options.instance} : doctor::instancesOf(doctor::Box())) {
    ControlOptions asked = options;
    asked.instance = name;
    if (!one) asked.timeout = kPatience;  // Prometheus waits ten seconds for all
    Measured measured{name, {}};
    try {
      measured.status = Control(asked).status();
    } catch (const Error&) {  // the instance does not run
    }
    all.push_back(std::move(measured));
  }
  std::string text = metricsText(all);
  if (http) {
    text = "HTTP/1.0 200 OK\r\nContent-Type: text/plain; version=0.0.4; charset=utf-8\r\nContent-Length: " +
           std::to_string(text.size()) + "\r\nConnection: close\r\n\r\n" + text;
  }
  if (std::fwrite(text.data(), 1, text.size(), stdout) == 0) expectReader();
  flushOutput();
}

/// Prints the description as one line of JSON.
void describe(const ControlOptions& options) {
  printLine(toJson(Control(options).description()));
}

/// `anyway`: takes the zero even if something seems to touch the gel. `undo`: restores the previous zero instead, and
/// `anyway` has no effect.
struct ZeroCommand {
  bool anyway = false, undo = false, json = false;
};

/// Takes or restores a zero and prints the result with its remark, as text or as one line of JSON.
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

/// Sends one software trigger, and prints the remarks of the answer; nothing if there are none.
void trigger(const ControlOptions& control) {
  CameraStep step;
  step.kind = CameraStep::Kind::kTrigger;
  for (const std::string& remark : Control(control).camera(step).remarks) printLine("note: " + remark);
}

}  // namespace

void addStatus(Commands& commands) {
  const auto json = std::make_shared<bool>(false);
  commands
      .add("status", "Prints the state of the daemon, and the account of all frames",
           [json](const Target& target) { return status(target.control(), *json), EX_OK; })
      .add_flag("--json", *json, "as JSON");
}

void addMetrics(Commands& commands) {
  const auto http = std::make_shared<bool>(false);
  commands
      .add("metrics",
           "Prints the state of the daemons on this machine as Prometheus reads it; with --instance or --control, of "
           "one",
           [http](const Target& target) {
             const ControlOptions control = target.control();
             metrics(control, target.isInstanceNamed() || !control.endpoint.empty(), *http);
             return EX_OK;
           })
      .add_flag("--http", *http, "as the answer to the HTTP request on standard input (traction-metrics.socket)");
}

void addDescribe(Commands& commands) {
  commands
      .add("describe", "Prints the sensor's description as JSON",
           [](const Target& target) { return describe(target.control()), EX_OK; })
      .add_flag("--json")
      ->description("has no effect: the output is JSON");
}

void addZero(Commands& commands) {
  const auto options = std::make_shared<ZeroCommand>();
  CLI::App& command = commands.add("zero", "Takes the next pictures as those of the unloaded gel",
                                   [options](const Target& target) { return zero(target.control(), *options), EX_OK; });
  auto* anyway = command.add_flag("--anyway", options->anyway, "proceeds even if something seems to touch the gel");
  command.add_flag("--undo", options->undo, "restores the previous zero instead")->excludes(anyway);
  command.add_flag("--json", options->json, "as JSON");
}

void addTrigger(Commands& commands) {
  commands.add("trigger", "Triggers one picture, if the camera's trigger is set to software",
               [](const Target& target) { return trigger(target.control()), EX_OK; });
}

}  // namespace traction::client

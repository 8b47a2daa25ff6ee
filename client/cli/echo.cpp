#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/notes.h"
#include "client/show/json.h"
#include "client/show/output.h"
#include "client/show/terminal.h"
#include "manual/number.h"
#include "traction/subscriber.h"

#include <sysexits.h>

#include <cstdio>
#include <map>
#include <memory>
#include <string>

namespace traction::client {

namespace {

using namespace std::chrono_literals;
using Count = unsigned long long;

constexpr auto kTurn = 100ms;

/// Prints messages of the chosen topics as JSON lines. Returns after `count` messages (negative: no limit), or on a
/// signal. Reports on standard error what Notes reports, and the messages lost in all at the end.
/// \param topics or-ed Topics, instead of `options.topics`
/// \throws Error kNoAnswer if no publisher is found in the first 3 s
void echo(const SubscriberOptions& options, unsigned topics, long count) {
  SubscriberOptions wanted = options;
  const bool tellsWhy = (topics & (kField | kMarkers)) != 0;  // why none comes
  wanted.topics = topics | (tellsWhy ? kDescription : 0U);
  Subscriber subscriber(wanted);
  Notes notes(subscriber,
              options.mode == Mode::kLatest ? "is it the endpoint 'stream' instead of 'latest'?"
                                            : "see tractionctl status",
              "standard output is read too slowly, or this machine is too busy",
              (topics & ~kOfTouch) == 0 && options.endpoint.empty() ? "traction-touch" : "tractiond");
  Count printed = 0;
  const auto account = [&] {
    std::string text = std::to_string(printed) + " messages printed";
    if (subscriber.lost() != 0) text += ", " + std::to_string(subscriber.lost()) + " lost";
    return text;
  };
  rememberSignals();
  try {
    while (!stopRequested() && (count < 0 || printed < static_cast<Count>(count))) {
      auto message = subscriber.receive(kTurn);
      if (message && std::holds_alternative<Description>(*message) && (topics & kDescription) == 0) {
        if (!std::get<Description>(*message).hasGel()) notes.hear(*message, Notes::Clock::now());
        message.reset();
      }
      if (message) notes.hear(*message, Notes::Clock::now());
      notes.noteConnection(subscriber.isConnected(), Notes::Clock::now());
      expectReader();
      if (!message) continue;
      if (!printLine(toJson(*message))) break;  // a signal came while the reader stalls
      ++printed;
    }
  } catch (const OutputError& error) {
    throw OutputError(std::string(error.what()) + "; " + account());
  }
  if (subscriber.lost() != 0) std::fprintf(stderr, "tractionctl: %s\n", account().c_str());
}

struct EchoLine {
  std::string topic = "field";
  long count = -1;
  bool latest = false;
};

}  // namespace

void addEcho(Commands& commands) {
  static const std::map<std::string, unsigned> kTopics = {
      {"field", kField},   {"markers", kMarkers}, {"description", kDescription},
      {"status", kStatus}, {"preview", kPreview}, {"contacts", kContacts},
      {"grasp", kGrasp},   {"all", kAllTopics}};
  const auto options = std::make_shared<EchoLine>();
  CLI::App& command = commands.add("echo", "Prints messages as JSON, one per line", [options](const Target& target) {
    if (options->latest && options->topic != "field")
      return fail(EX_USAGE, "--latest provides only fields, not --topic " + options->topic);
    echo(target.subscription(options->latest), kTopics.at(options->topic), options->count);
    return EX_OK;
  });
  command
      .add_option(
          "--topic", options->topic,
          "topic of the messages; all: each except preview, whose pixels are printed as base64, and contacts and "
          "grasp, which traction-touch publishes")
      ->check(CLI::IsMember(&kTopics))
      ->capture_default_str();
  command.add_option("--count", options->count, "number of messages; without it: until Ctrl-C")
      ->type_name("NUMBER")
      ->check(manual::number(0.0, 1e15, "a number of messages, as in 100"));
  command.add_flag("--latest", options->latest,
                   "only the newest field, from the endpoint 'latest': a slow reader misses those between");
}

}  // namespace traction::client

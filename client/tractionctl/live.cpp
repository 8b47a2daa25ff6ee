// watch, top, touch and echo: what is received as it is published.

#include "client/cli/commands.h"
#include "client/cli/top.h"
#include "client/tractionctl/commands.h"
#include "client/tractionctl/exit_codes.h"
#include "client/tractionctl/parsing.h"

#include <sysexits.h>

#include <map>
#include <memory>

namespace traction::cli {

namespace {

void addSeconds(CLI::App& command, double& seconds) {
  command.add_option("--seconds", seconds, "duration; without it: until q or Ctrl-C")
      ->type_name("SECONDS")
      ->check(timeSpan());
}

struct EchoLine {
  std::string topic = "field";
  long count = -1;
  bool latest = false;
};

}  // namespace

void addWatch(Commands& commands) {
  const auto seconds = std::make_shared<double>(kForever);
  addSeconds(commands.add("watch", "Shows the forces live; without a terminal, prints one line per second",
                          [seconds](const Target& target) { return watch(target.subscription(), *seconds), EX_OK; }),
             *seconds);
}

void addTop(Commands& commands) {
  const auto options = std::make_shared<TopCommand>();
  CLI::App& command =
      commands.add("top",
                   "Shows the state of instruments live: rates, latencies, the account of all frames; without a "
                   "terminal, prints one line per second",
                   [options](const Target& target) {
                     const SubscriberOptions subscription = target.subscription();
                     top(subscription, *options, target.isInstanceNamed() || !subscription.endpoint.empty());
                     return EX_OK;
                   });
  command
      .add_option("endpoints", options->endpoints,
                  "ZeroMQ endpoints of streams, or instances on this machine; without them: all instances")
      ->type_name("ENDPOINT");
  command.add_flag("--once", options->once, "prints all numbers once, and ends");
  addSeconds(command, options->seconds);
}

void addTouch(Commands& commands) {
  const auto seconds = std::make_shared<double>(kForever);
  addSeconds(commands.add("touch",
                          "Prints contacts as they begin, last and end, each with its id; starts traction-touch if it "
                          "does not run",
                          [seconds](const Target& target) { return touch(target.subscription(), *seconds), EX_OK; }),
             *seconds);
}

void addEcho(Commands& commands) {
  static const std::map<std::string, unsigned> kTopics = {
      {"field", kField},   {"markers", kMarkers}, {"description", kDescription},
      {"status", kStatus}, {"preview", kPreview}, {"contacts", kContacts},
      {"all", kAllTopics}};
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
          "topic of the messages; all: each except preview, whose pixels are printed as base64, and contacts, which "
          "traction-touch publishes")
      ->check(CLI::IsMember(&kTopics))
      ->capture_default_str();
  command.add_option("--count", options->count, "number of messages; without it: until Ctrl-C")
      ->type_name("NUMBER")
      ->check(integer("a number of messages, as in 100"));
  command.add_flag("--latest", options->latest,
                   "only the newest field, from the endpoint 'latest': a slow reader misses those between");
}

}  // namespace traction::cli

#include "client/cli/commands.h"
#include "client/cli/json.h"
#include "client/cli/notes.h"
#include "client/cli/output.h"
#include "client/cli/terminal.h"

#include <cstdio>

namespace traction::cli {

namespace {

using namespace std::chrono_literals;
using Count = unsigned long long;

constexpr auto kTurn = 100ms;

}  // namespace

void echo(const SubscriberOptions& options, unsigned topics, long count) {
  SubscriberOptions wanted = options;
  const bool tellsWhy = (topics & (kField | kMarkers)) != 0;  // why none comes
  wanted.topics = topics | (tellsWhy ? kDescription : 0U);
  Subscriber subscriber(wanted);
  Notes notes(subscriber,
              options.mode == Mode::kLatest ? "is it the endpoint 'stream' instead of 'latest'?"
                                            : "see tractionctl status",
              "standard output is read too slowly, or this machine is too busy",
              topics == kContacts && options.endpoint.empty() ? "traction-touch" : "tractiond");
  Count printed = 0, unprinted = 0;
  const auto account = [&] {
    std::string text = std::to_string(printed) + " messages printed";
    if (subscriber.lost() != 0) text += ", " + std::to_string(subscriber.lost()) + " lost";
    if (unprinted != 0) text += ", " + std::to_string(unprinted) + " that waited not printed";
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
      if (printLine(toJson(*message))) {
        ++printed;
        continue;
      }
      // The reader stalls.
      for (unprinted = 1; subscriber.receive(0ms);) ++unprinted;  // a description among them counts, too
    }
  } catch (const OutputError& error) {
    throw OutputError(std::string(error.what()) + "; " + account());
  }
  if (subscriber.lost() + unprinted != 0) std::fprintf(stderr, "tractionctl: %s\n", account().c_str());
}

}  // namespace traction::cli

#include "client/cli/commands.h"
#include "client/cli/json.h"
#include "client/cli/output.h"
#include "client/cli/terminal.h"

#include <cstdio>

namespace traction::cli {

namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using Count = unsigned long long;

constexpr auto kTurn = 100ms;
constexpr auto kPatience = 3s;      ///< for the connection, and for a first message
constexpr auto kBetweenNotes = 1s;  ///< of losses

const Header& headerOf(const Message& message) {
  return std::visit([](const auto& any) -> const Header& { return any.header; }, message);
}

/// What is told beside the messages, on standard error.
class Notes {
 public:
  Notes(const Subscriber& subscriber, bool isLatest)
      : subscriber_(subscriber)
      , isLatest_(isLatest) {}

  /// In every turn. \throws Error kNoAnswer
  void look(bool isConnected, Clock::time_point now) {
    const bool late = now - start_ >= kPatience;
    if (!wasConnected_ && !isConnected && late) {
      throw Error(ErrorCode::kNoAnswer, "nobody publishes at " + subscriber_.endpoint() + "; is tractiond running?");
    }
    if (wasConnected_ && isConnected != isConnected_)
      say(isConnected ? "tractiond is back" : "tractiond is gone; waiting for it");
    isConnected_ = isConnected;
    wasConnected_ = wasConnected_ || isConnected;
    if (isConnected && late && !heard_) {
      heard_ = true;
      say("connected, but nothing of this topic comes from " + subscriber_.endpoint() +
          (isLatest_ ? "; is it the endpoint 'stream' instead of 'latest'?" : "; see tractionctl status"));
    }
    noteLosses(now);
  }

  void hear(const Message& message, Clock::time_point now) {
    heard_ = wasConnected_ = isConnected_ = true;
    const Header& header = headerOf(message);
    if (boot_ && *boot_ != header.boot) say("tractiond was started anew");
    boot_ = header.boot;
    sequence_ = header.sequence;
    noteLosses(now);
  }

 private:
  static void say(const std::string& what) { std::fprintf(stderr, "tractionctl: %s\n", what.c_str()); }

  void noteLosses(Clock::time_point now) {
    const std::uint64_t lost = subscriber_.lost();
    if (lost == told_ || (told_ != 0 && now - toldAt_ < kBetweenNotes)) return;
    say(std::to_string(lost - told_) + " messages lost before number " + std::to_string(sequence_) +
        ": standard output is read too slowly, or this machine is too busy");
    told_ = lost;
    toldAt_ = now;
  }

  const Subscriber& subscriber_;
  bool isLatest_;
  bool isConnected_ = false, wasConnected_ = false, heard_ = false;
  std::optional<Id> boot_;
  std::uint64_t sequence_ = 0;
  std::uint64_t told_ = 0;  ///< of the losses
  Clock::time_point start_ = Clock::now(), toldAt_;
};

}  // namespace

void echo(const SubscriberOptions& options, unsigned topics, long count) {
  SubscriberOptions wanted = options;
  wanted.topics = topics;
  Subscriber subscriber(wanted);
  Notes notes(subscriber, options.mode == Mode::kLatest);
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
      const auto message = subscriber.receive(kTurn);
      if (message) notes.hear(*message, Clock::now());
      notes.look(subscriber.isConnected(), Clock::now());
      expectReader();
      if (!message) continue;
      if (printLine(toJson(*message))) {
        ++printed;
        continue;
      }
      // The reader stalls: what has come is in its way.
      for (unprinted = 1; subscriber.receive(0ms);) ++unprinted;
    }
  } catch (const OutputError& error) {
    throw OutputError(std::string(error.what()) + "; " + account());
  }
  if (subscriber.lost() + unprinted != 0) std::fprintf(stderr, "tractionctl: %s\n", account().c_str());
}

}  // namespace traction::cli

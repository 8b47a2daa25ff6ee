// Shows the state of instruments live.
#include "client/cli/commands.h"
#include "client/cli/notes.h"
#include "client/doctor/checks.h"
#include "client/show/board.h"
#include "client/show/output.h"
#include "client/show/receiver.h"
#include "client/show/terminal.h"
#include "traction/subscriber.h"
#include "traction/v1/status.pb.h"

#include <sysexits.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace traction::client {

namespace {

using namespace std::chrono_literals;

constexpr auto kPage = 60ms;  ///< between two pages; old figures are marked within half a second
constexpr auto kLine = 1s;    ///< between two lines
constexpr auto kFirst = 3s;   ///< for a connection, and for the first figures

/// Receives the messages of one instrument.
class Watcher {
 public:
  Watcher(const SubscriberOptions& options, const std::string& name)
      : receiver_(options) {
    watched_.name = name;
    if (name != receiver_.endpoint()) watched_.endpoint = receiver_.endpoint();
  }

  const Watched& refresh(Clock::time_point now) {
    try {
      watched_.scene = receiver_.scene();
    } catch (const Error& error) {
      watched_.failure = error.what();
      watched_.scene.setConnected(false, nanoseconds(now));
    }
    isKnown_ =
        isKnown_ || !watched_.failure.empty() || watched_.scene.connected() || watched_.scene.lastArrival_ns != 0;
    return watched_;
  }

  /// Returns whether a publisher was ever connected.
  bool isKnown() const { return isKnown_; }
  /// Returns whether all figures have arrived, or none will.
  bool isComplete() const {
    const Scene& scene = watched_.scene;
    if (!watched_.failure.empty()) return true;
    const bool sends = scene.status && (*scene.status)->camera() == v1::CAMERA_STATE_STREAMING;
    return scene.status && scene.statusBefore && scene.description && (scene.field || !sends);
  }
  const std::string& endpoint() const { return receiver_.endpoint(); }

 private:
  Receiver receiver_;
  Watched watched_;
  bool isKnown_ = false;
};

struct TopCommand {
  std::vector<std::string> endpoints;  ///< endpoints or names of local instances; empty: see top()
  double seconds = kForever;           ///< duration
  bool once = false;                   ///< prints all figures when they have arrived, or after 3 s, and ends
};

using Watchers = std::vector<std::unique_ptr<Watcher>>;

Watchers watchersFor(const SubscriberOptions& options, const TopCommand& command, bool one) {
  Watchers all;
  const auto add = [&](const std::string& instance, const std::string& endpoint) {
    SubscriberOptions wanted = options;
    wanted.topics = kField | kDescription | kStatus;
    if (!instance.empty()) wanted.instance = instance;
    if (!instance.empty() || !endpoint.empty()) wanted.endpoint = endpoint;
    const std::string& name = wanted.endpoint.empty() ? wanted.instance : wanted.endpoint;
    all.push_back(std::make_unique<Watcher>(wanted, name));
  };
  for (const std::string& word : command.endpoints) {
    const bool isEndpoint = word.find("://") != std::string::npos;
    add(isEndpoint ? "" : word, isEndpoint ? word : "");
  }
  if (!command.endpoints.empty()) return all;
  if (one) {
    add("", "");
  } else {
    for (const std::string& name : doctor::instancesOf(doctor::Box())) add(name, "");
  }
  return all;
}

void expectPublisher(const Watchers& all, Clock::duration elapsed) {
  const bool isAnyKnown = std::any_of(all.begin(), all.end(), [](const auto& one) { return one->isKnown(); });
  if (isAnyKnown || elapsed < kFirst) return;
  std::string where;
  for (const auto& one : all) where += (where.empty() ? "" : ", ") + one->endpoint();
  throw noPublisher(where);
}

/// Calls show(instruments, now, time until the next call) until it returns false, the time is over or a signal came.
template <typename Show>
void loop(const Watchers& all, double seconds, Show&& show) {
  const Clock::time_point start = Clock::now();
  for (Clock::time_point next = start; !stopRequested();) {
    const Clock::time_point now = Clock::now();
    std::vector<Watched> known;
    for (const auto& one : all) known.push_back(one->refresh(now));
    expectPublisher(all, now - start);
    next = std::max(next + kPage, now);  // after a delay of the terminal, only one page is drawn
    if (!show(known, now, next - now) || std::chrono::duration<double>(now - start).count() >= seconds) return;
  }
}

void printAll(const std::vector<Watched>& known, Clock::time_point now) {
  for (const Watched& one : known) {
    std::string text = boardText(one, nanoseconds(now));
    text.pop_back();  // the newline
    if (!printLines(text)) return;
  }
}

/// If isTerminal(), draws a page until q is pressed; otherwise prints one line per instrument and second. Returns also
/// after `command.seconds` and on SIGINT, SIGTERM or SIGHUP, whose handlers it sets. An instrument that can no longer
/// be received is shown with the reason.
/// \param options for each subscription, except topics
/// \param one without effect if endpoints are given; true: only the instance or endpoint of `options`; false: all
/// instances of this machine
/// \throws Error kNoAnswer if there is no publisher at any endpoint in the first 3 s, kBadEndpoint, kBadKeys;
/// OutputError
void top(const SubscriberOptions& options, const TopCommand& command, bool one) {
  rememberSignals();
  const Watchers all = watchersFor(options, command, one);
  if (command.once) {
    const Clock::time_point start = Clock::now();
    loop(all, command.seconds, [&](const auto& known, Clock::time_point now, Clock::duration left) {
      const bool isComplete = std::all_of(all.begin(), all.end(), [](const auto& each) { return each->isComplete(); });
      if (isComplete || now - start >= kFirst) return printAll(known, now), false;
      std::this_thread::sleep_for(left);
      return true;
    });
  } else if (isTerminal()) {
    const Terminal terminal;
    loop(all, command.seconds, [&](const auto& known, Clock::time_point now, Clock::duration left) {
      const auto [width, height] = terminal.size();
      if (!terminal.show(drawBoard(known, width, height, nanoseconds(now)))) return false;
      return terminal.waitForKey(std::chrono::ceil<std::chrono::milliseconds>(left)) != 'q';
    });
  } else {
    if (const std::string hint = viewHint(); !hint.empty()) std::fprintf(stderr, "tractionctl: %s\n", hint.c_str());
    Clock::time_point due;
    loop(all, command.seconds, [&](const auto& known, Clock::time_point now, Clock::duration left) {
      expectReader();
      const bool isKnown = std::any_of(all.begin(), all.end(), [](const auto& each) { return each->isKnown(); });
      for (auto each = known.begin(); isKnown && now >= due && each != known.end(); ++each) {
        if (!printLine(boardLine(*each, nanoseconds(now)))) return false;
      }
      if (isKnown && now >= due) due = now + kLine;
      std::this_thread::sleep_for(left);
      return true;
    });
  }
}

}  // namespace

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

}  // namespace traction::client

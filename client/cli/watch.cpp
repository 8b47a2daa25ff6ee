#include "client/cli/commands.h"
#include "client/cli/notes.h"
#include "client/show/health.h"
#include "client/show/output.h"
#include "client/show/picture.h"
#include "client/show/receiver.h"
#include "client/show/terminal.h"
#include "traction/subscriber.h"

#include <sysexits.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

namespace traction::client {

namespace {

using namespace std::chrono_literals;

constexpr auto kPicture = 40ms;  ///< between two pictures
constexpr auto kPatience = 3s;   ///< for the connection

template <typename Step>
Scene loop(Receiver& receiver, double seconds, Clock::duration step, Step&& show) {
  const Clock::time_point start = Clock::now();
  for (Clock::time_point next = start;; next += step) {
    const Clock::time_point now = Clock::now();
    Scene scene = receiver.scene();
    const bool isKnown = scene.lastArrival_ns != 0 || scene.connected();
    if (!isKnown && now - start >= kPatience) throw noPublisher(receiver.endpoint());
    const bool isOver = std::chrono::duration<double>(now - start).count() >= seconds;
    if (stopRequested() || !show(scene, now, std::max(next + step - now, Clock::duration(0))) || isOver) return scene;
  }
}

/// Runs the live view; unless isTerminal(), prints summary() once per second instead, and at once when the reason why
/// there is no field changes; a note on the zero once, on standard error. Returns after `seconds`, on a signal, or when
/// the key q is pressed in the live view. Receives fields, descriptions and the status, whatever `options.topics` is.
/// \param seconds kForever: no limit
/// \throws Error kNoAnswer if no publisher is found in the first 3 s; later it waits for the daemon's return
void watch(const SubscriberOptions& options, double seconds) {
  SubscriberOptions wanted = options;
  wanted.topics = kField | kDescription | kStatus | kContacts;
  const bool isLive = isTerminal();
  rememberSignals();
  Receiver receiver(wanted);
  Scene last;
  if (isLive) {
    const Terminal terminal;
    Scale scale;
    last = loop(receiver, seconds, kPicture, [&](const Scene& scene, Clock::time_point now, Clock::duration left) {
      const auto [width, height] = terminal.size();
      const Canvas page = draw(scene, width, height, scale, nanoseconds(now), receiver.endpoint());
      if (!terminal.show(page)) return false;
      return terminal.waitForKey(std::chrono::ceil<std::chrono::milliseconds>(left)) != 'q';
    });
  } else {
    if (const std::string hint = viewHint(); !hint.empty()) std::fprintf(stderr, "tractionctl: %s\n", hint.c_str());
    std::optional<std::string> printed;  // the trouble in the last line
    bool hasNote = false;
    Clock::time_point due;
    last = loop(receiver, seconds, kPicture, [&](const Scene& scene, Clock::time_point now, Clock::duration left) {
      expectReader();
      const std::string trouble = scene.trouble(nanoseconds(now)).what;
      const bool isNews = printed && *printed != trouble;  // is printed at once
      if ((printed || scene.connected()) && (isNews || now >= due)) {
        due = now + 1s;
        printed = trouble;
        if (!printLine(summary(scene, nanoseconds(now)))) return false;
        const std::vector<Problem> all = problems(scene, nanoseconds(now));
        const auto isNote = [](const Problem& one) { return one.health == Health::kMeasuring; };
        const auto note = std::find_if(all.begin(), all.end(), isNote);
        if (note != all.end() && !std::exchange(hasNote, true))
          std::fprintf(stderr, "tractionctl: note: %s; with nothing on the gel, tractionctl zero takes one that is\n",
                       note->what.c_str());
      }
      std::this_thread::sleep_for(left);
      return true;
    });
  }
  if (isLive && last.lastArrival_ns != 0) {
    std::printf("%llu fields received, %llu messages lost on the way\n", static_cast<unsigned long long>(last.fields),
                static_cast<unsigned long long>(last.lost));
  }
}

}  // namespace

void addWatch(Commands& commands) {
  const auto seconds = std::make_shared<double>(kForever);
  addSeconds(commands.add("watch", "Shows the forces live; without a terminal, prints one line per second",
                          [seconds](const Target& target) { return watch(target.subscription(), *seconds), EX_OK; }),
             *seconds);
}

}  // namespace traction::client

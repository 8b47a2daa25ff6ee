#include "client/cli/notes.h"
#include "client/cli/recordings.h"
#include "client/files/tape.h"
#include "client/show/terminal.h"

#include <cstdio>

namespace traction::client {

namespace {

using namespace std::chrono_literals;

constexpr auto kTurn = 20ms;  ///< by which a chunk may be late
constexpr int kQueue = 4000;  ///< messages that may wait for a slow disk: half a minute at 60 frames/s

}  // namespace

void record(const SubscriberOptions& options, const std::string& file, double seconds) {
  SubscriberOptions all = options;
  all.queue = kQueue;
  Subscriber subscriber(all);
  Notes notes(subscriber, "see tractionctl status", "the disk, or this machine, is too busy");
  Tape tape(file);
  rememberSignals();
  const auto begin = Notes::Clock::now();
  const auto isOver = [&] { return std::chrono::duration<double>(Notes::Clock::now() - begin).count() >= seconds; };
  try {
    while (!stopRequested() && !isOver()) {
      const auto message = subscriber.receive(kTurn);
      if (message) {
        tape.add(*message, subscriber.raw());
        notes.hear(*message, Notes::Clock::now());
      }
      notes.noteConnection(subscriber.isConnected(), Notes::Clock::now());
      tape.flushIfDue();
    }
    if (tape.isEmpty() && !subscriber.isConnected()) {
      throw noPublisher(subscriber.endpoint());
    }
  } catch (const Error&) {
    if (!tape.isEmpty()) tape.close();
    tape.drop();
    throw;
  }
  tape.close();
  std::printf("%s: %s; each was on disk after at most %.2f s; %llu lost\n", file.c_str(), tape.account().c_str(),
              tape.longestWait_s(), static_cast<unsigned long long>(subscriber.lost()));
}

}  // namespace traction::client

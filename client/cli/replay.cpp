#include "client/cli/recordings.h"
#include "client/cli/sockets.h"
#include "client/files/file_error.h"
#include "client/show/output.h"
#include "client/show/terminal.h"
#include "recording/reader.h"

#include <sysexits.h>

#include <algorithm>
#include <chrono>
#include <cstdio>

namespace traction::client {

namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kTurn = 20ms;
constexpr double kNever_s = 1e9;  ///< times of a file may be anything

struct Stopped {};

void listenUntil(Repeater& repeater, Clock::time_point due) {
  for (;;) {
    if (stopRequested()) throw Stopped{};
    const auto left = due - Clock::now();
    if (left <= 0ms) return;
    repeater.listen(std::min(std::chrono::ceil<std::chrono::milliseconds>(left), kTurn));
  }
}

}  // namespace

void replay(const std::string& file, const std::string& endpoint, double speed) {
  const auto reader = orThrow(recording::Reader::open(file));
  Repeater repeater(endpoint);
  rememberSignals();
  printLine("waiting for a subscriber at " + repeater.endpoint());
  std::uint64_t messages = 0, first_ns = 0;
  Clock::time_point begin;
  try {
    while (!repeater.isHeard()) listenUntil(repeater, Clock::now() + kTurn);
    begin = Clock::now();
    const auto extent = orThrow(reader.read(
        [&](const recording::Channel& channel, const recording::Schema*, const recording::Message& message) {
          if (!channel.topic.starts_with("traction/")) return;  // the stream has no other
          if (messages++ == 0) first_ns = message.logTime_ns;
          const std::uint64_t after_ns = message.logTime_ns - std::min(first_ns, message.logTime_ns);
          const std::chrono::duration<double> after(std::min(1e-9 * static_cast<double>(after_ns) / speed, kNever_s));
          listenUntil(repeater, begin + std::chrono::duration_cast<Clock::duration>(after));
          repeater.send({channel.topic, message.data}, 1e-9 * static_cast<double>(message.publishTime_ns));
        }));
    printLine(file + ": " + std::to_string(messages) + " messages sent");
    if (!extent.isWhole()) throw FileError(EX_DATAERR, file + ": " + extent.trouble);
  } catch (const Stopped&) {
    std::printf("%s: stopped after %llu messages\n", file.c_str(), static_cast<unsigned long long>(messages));
  }
}

}  // namespace traction::client

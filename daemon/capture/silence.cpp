#include "daemon/capture/silence.h"

#include <fstream>
#include <utility>

namespace tractiond::capture {

Silence causeOfSilence(StreamSigns& signs) {
  constexpr int kHanging = 5, kMost = 40;  // pauses
  const std::uint64_t before = signs.received();
  int idle = 0;
  for (int pauses = 0; signs.hasPacketsWaiting() && signs.received() == before; ++pauses) {
    if (idle == kHanging || pauses == kMost) return Silence::kThreadHangs;
    signs.pause();
    if (!signs.isWaitingForProcessor()) ++idle;
  }
  // An answer may be late where packets are not: one thread of a camera may do both.
  if (signs.answers() || signs.received() != before || signs.hasPacketsWaiting()) return Silence::kAlive;
  return Silence::kNoAnswer;
}

ProcessorWait::ProcessorWait(int threadId)
    : folder_("/proc/self/task/" + std::to_string(threadId)) {
  lasts();
}

bool ProcessorWait::lasts() {
  std::uint64_t ran_ns = 0;
  std::string stat;
  if (!(std::ifstream(folder_ + "/schedstat") >> ran_ns) || !std::getline(std::ifstream(folder_ + "/stat"), stat))
    return false;
  const bool hasRun = std::exchange(ran_ns_, ran_ns) != ran_ns;
  const std::size_t state = stat.rfind(") ");  // the name before it may hold anything
  return !hasRun && state != std::string::npos && state + 2 < stat.size() && stat[state + 2] == 'R';
}

}  // namespace tractiond::capture

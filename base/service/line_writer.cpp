#include "base/service/line_writer.h"

#include <poll.h>
#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <climits>
#include <condition_variable>
#include <csignal>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

namespace tractiond {

namespace {

constexpr int kLook_ms = 100;  // time between two checks for the end, while the reader does not read

}  // namespace

struct LineWriter::Shared {
  int descriptor = -1;
  LineWriterOptions options;

  std::mutex mutex;
  std::condition_variable come, gone;
  std::string waiting;         // whole lines
  std::uint64_t lostHere = 0;  // not reported yet
  bool writing = false, ending = false;
  std::atomic<std::uint64_t> lost{0};
  std::atomic<bool> givenUp{false};

  void run() {
    sigset_t signals;
    sigfillset(&signals);  // other threads handle them; without SIGPIPE a missing reader is an error of write()
    pthread_sigmask(SIG_BLOCK, &signals, nullptr);
    std::unique_lock lock(mutex);
    while (true) {
      come.wait(lock, [&] { return ending || !waiting.empty(); });
      if (waiting.empty()) return;
      const std::string batch = std::exchange(waiting, {});
      writing = true;
      lock.unlock();
      put(batch);
      lock.lock();
      writing = false;
      tellLost();
      gone.notify_all();
    }
  }

  void tellLost() {
    if (lostHere == 0) return;
    waiting += options.prefix + std::to_string(std::exchange(lostHere, 0)) +
               " lines of this log are lost: the reader was too slow\n";
  }

  void put(std::string_view text) {
    while (!text.empty() && !givenUp) {
      pollfd output{descriptor, POLLOUT, 0};
      if (poll(&output, 1, kLook_ms) <= 0) continue;
      // Writes at most what a pipe takes without waiting.
      const ssize_t written = ::write(descriptor, text.data(), std::min<std::size_t>(text.size(), PIPE_BUF));
      if (written > 0) text.remove_prefix(static_cast<std::size_t>(written));
      if (written >= 0 || errno == EINTR || errno == EAGAIN) continue;
      lost +=
          static_cast<std::uint64_t>(std::ranges::count(text, '\n'));  // the disk is full, or the pipe has no reader
      return;
    }
  }
};

LineWriter::LineWriter(int descriptor, const LineWriterOptions& options)
    : shared_(std::make_shared<Shared>()) {
  shared_->descriptor = descriptor;
  shared_->options = options;
  std::thread([shared = shared_] { shared->run(); }).detach();
}

LineWriter::~LineWriter() {
  drain();
}

void LineWriter::drain() {
  std::unique_lock lock(shared_->mutex);
  shared_->ending = true;
  shared_->come.notify_all();
  shared_->gone.wait_for(lock, shared_->options.patience,
                         [&] { return shared_->waiting.empty() && !shared_->writing; });
  shared_->givenUp = true;
}

void LineWriter::write(std::string_view line) {
  const std::lock_guard lock(shared_->mutex);
  // After a lost line further ones are lost, too, until their number has been written.
  if (shared_->lostHere > 0 || shared_->waiting.size() + line.size() + 1 > shared_->options.most_bytes) {
    ++shared_->lostHere;
    ++shared_->lost;
    return;
  }
  shared_->waiting.append(line) += '\n';
  shared_->come.notify_one();
}

std::uint64_t LineWriter::lost() const {
  return shared_->lost;
}

}  // namespace tractiond

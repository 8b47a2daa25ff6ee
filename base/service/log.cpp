#include "base/service/log.h"

#include "base/event.h"
#include "base/printable.h"
#include "base/service/service.h"

#include <poll.h>
#include <pthread.h>
#include <spdlog/async.h>
#include <spdlog/details/null_mutex.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <utility>
#include <vector>

namespace tractiond {
namespace {

using spdlog::details::thread_pool;

std::string prefix(std::string_view program, spdlog::level::level_enum level) {
  // From trace on.
  constexpr std::array<const char*, spdlog::level::n_levels> kPriorities = {SD_DEBUG, SD_DEBUG, SD_INFO, SD_WARNING,
                                                                            SD_ERR,   SD_ERR,   SD_INFO};
  return logsToJournal() ? kPriorities.at(static_cast<std::size_t>(level)) : std::string(program) + ": ";
}

/// Starts spdlog's thread. It is never joined, because it waits for the reader, which may stand still when the process
/// ends.
std::shared_ptr<thread_pool> startThread() {
  constexpr std::size_t kLines = 1024;
  static auto* const started = new std::vector<std::shared_ptr<thread_pool>>;
  return started->emplace_back(std::make_shared<thread_pool>(kLines, 1, [] {
    sigset_t signals;
    sigfillset(&signals);  // other threads handle them; without SIGPIPE a missing reader is an error of write()
    pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  }));
}

}  // namespace

class Log::Sink : public spdlog::sinks::base_sink<spdlog::details::null_mutex> {
 public:
  Sink(std::string program, int descriptor, std::shared_ptr<thread_pool> thread)
      : program_(std::move(program))
      , descriptor_(descriptor)
      , thread_(std::move(thread)) {}

  std::uint64_t lost() const { return thread_->overrun_counter() + unwritten_; }
  void waitForFlush(std::chrono::milliseconds patience) { flushed_.wait(patience); }

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    if (const std::size_t lost = thread_->overrun_counter(); lost != reported_) {
      put(logLine(program_, spdlog::level::warn,
                  std::to_string(lost - std::exchange(reported_, lost)) +
                      " lines of this log are lost: the reader was too slow"));
    }
    put(logLine(program_, message.level, {message.payload.data(), message.payload.size()}));
  }
  void flush_() override { flushed_.signal(); }

  void put(std::string line) {
    line += '\n';
    for (std::string_view rest = line; !rest.empty();) {
      const ssize_t written = ::write(descriptor_, rest.data(), rest.size());
      if (written > 0) {
        rest.remove_prefix(static_cast<std::size_t>(written));
      } else if (errno == EAGAIN) {
        pollfd output{descriptor_, POLLOUT, 0};
        poll(&output, 1, -1);
      } else if (errno != EINTR) {
        ++unwritten_;  // the disk is full, or the pipe has no reader
        return;
      }
    }
  }

  const std::string program_;
  const int descriptor_;
  const std::shared_ptr<thread_pool> thread_;
  std::size_t reported_ = 0;
  std::atomic<std::uint64_t> unwritten_{0};
  Event flushed_;
};

std::string logLine(std::string_view program, spdlog::level::level_enum level, std::string_view text) {
  return prefix(program, level).append(traction::printable(text));
}

Log::Log(const std::string& program, const std::string& level, int descriptor) {
  auto thread = startThread();
  sink_ = std::make_shared<Sink>(program, descriptor, thread);
  logger_ =
      std::make_shared<spdlog::async_logger>(program, sink_, thread, spdlog::async_overflow_policy::overrun_oldest);
  logger_->set_level(spdlog::level::from_str(level));
  spdlog::set_default_logger(logger_);
}

Log::~Log() {
  drain();
}

void Log::drain() {
  constexpr std::chrono::milliseconds kPatience(500);
  logger_->flush();
  sink_->waitForFlush(kPatience);
}

std::uint64_t Log::lost() const {
  return sink_->lost();
}

}  // namespace tractiond

#include "base/child.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>

extern char** environ;  // NOLINT: POSIX

namespace tractiond {
namespace {

using Clock = std::chrono::steady_clock;

/// A pipe of which the child has the end that is written to.
struct Pipe {
  Pipe() {
    if (pipe2(ends.data(), O_CLOEXEC) != 0) ends = {-1, -1};
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  ~Pipe() {
    closeEnd(0);
    closeEnd(1);
  }
  void closeEnd(std::size_t which) {
    if (ends[which] >= 0) close(ends[which]);
    ends[which] = -1;
  }
  std::array<int, 2> ends{-1, -1};
};

/// Returns 0 or the reason why it was not started.
int start(const std::vector<std::string>& arguments, const std::string& program, const Pipe& output, const Pipe& errors,
          pid_t& child) {
  std::vector<char*> words{const_cast<char*>(program.c_str())};  // NOLINT: exec's arguments are not const
  for (const std::string& word : arguments) words.push_back(const_cast<char*>(word.c_str()));  // NOLINT
  words.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&actions);
  posix_spawnattr_init(&attributes);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, output.ends[1], STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, errors.ends[1], STDERR_FILENO);
  posix_spawn_file_actions_addclosefrom_np(&actions, STDERR_FILENO + 1);
  // A terminal and a service manager send these to the child as well: that one ends with us is not its fault. A stop
  // and our own end do end it.
  sigset_t blocked, all;
  sigemptyset(&blocked);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) sigaddset(&blocked, signal);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&attributes, &blocked);  // not as our threads have it
  posix_spawnattr_setsigdefault(&attributes, &all);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  const int failure = posix_spawnp(&child, program.c_str(), &actions, &attributes, words.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  return failure;
}

}  // namespace

ChildEnd runChild(const std::vector<std::string>& arguments, const ChildOptions& options, const std::stop_token& stop) {
  using How = ChildEnd::How;
  constexpr int kTurn_ms = 50;
  ChildEnd end;
  Pipe output, errors;
  pid_t child = -1;
  end.code =
      output.ends[0] < 0 || errors.ends[0] < 0 ? errno : start(arguments, options.program, output, errors, child);
  if (end.code != 0) return end;
  output.closeEnd(1);
  errors.closeEnd(1);

  std::array<Pipe*, 2> pipes{&output, &errors};
  std::array<std::string*, 2> texts{&end.output, &end.errors};
  const auto until = Clock::now() + options.patience;
  end.how = How::kExit;
  const auto isOver = [&] {
    if (stop.stop_requested())
      end.how = How::kStopped;
    else if (Clock::now() > until)
      end.how = How::kLate;
    return end.how != How::kExit;
  };
  while ((output.ends[0] >= 0 || errors.ends[0] >= 0) && !isOver()) {
    std::array<pollfd, 2> items{pollfd{output.ends[0], POLLIN, 0}, pollfd{errors.ends[0], POLLIN, 0}};
    if (poll(items.data(), items.size(), kTurn_ms) <= 0) continue;
    for (std::size_t i = 0; i < pipes.size(); ++i) {
      if (items[i].revents == 0) continue;
      std::array<char, 4096> bytes{};
      const ssize_t got = read(pipes[i]->ends[0], bytes.data(), bytes.size());
      if (got > 0)
        texts[i]->append(bytes.data(), static_cast<std::size_t>(got));
      else if (got == 0 || errno != EINTR)
        pipes[i]->closeEnd(0);
    }
    if (end.output.size() > options.most_bytes || end.errors.size() > options.most_bytes) {
      end.how = How::kTooMuch;
      break;
    }
  }
  // A child that has closed both, and lives on, has its time limit, too.
  int status = 0;
  pid_t ended = 0;
  while (end.how == How::kExit && (ended = waitpid(child, &status, WNOHANG)) == 0) {
    if (!isOver()) poll(nullptr, 0, 1);
  }
  if (end.how != How::kExit) {
    kill(child, SIGKILL);
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    return end;
  }
  if (ended == child && WIFSIGNALED(status)) {
    end.how = How::kSignal;
    end.code = WTERMSIG(status);
  } else {
    end.code = ended == child ? WEXITSTATUS(status) : 0;
  }
  return end;
}

}  // namespace tractiond

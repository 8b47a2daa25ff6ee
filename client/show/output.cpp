#include "client/show/output.h"

#include "base/printable.h"
#include "client/show/terminal.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <string>

namespace traction::client {

namespace {

constexpr int kPatience_ms = 100;  ///< between two checks for a signal

[[noreturn]] void fail(int error) {
  if (error == EPIPE) throw OutputError("standard output has no reader any more");
  throw OutputError(std::string("standard output cannot be written: ") + std::strerror(error));
}

/// Returns whether some bytes can be written without waiting.
bool waitForReader() {
  pollfd output{STDOUT_FILENO, POLLOUT, 0};
  const int ready = poll(&output, 1, kPatience_ms);
  if (ready < 0 && errno != EINTR) fail(errno);
  if ((output.revents & POLLNVAL) != 0) fail(EBADF);
  return ready > 0;
}

bool print(std::string_view text) {
  while (!text.empty()) {
    if (stopRequested()) return false;
    if (!waitForReader()) continue;
    // Not more than a pipe takes without waiting: a signal would not be seen then.
    const ssize_t written = write(STDOUT_FILENO, text.data(), std::min<std::size_t>(text.size(), PIPE_BUF));
    if (written < 0 && errno != EINTR && errno != EAGAIN) fail(errno);
    if (written > 0) text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

}  // namespace

void rememberOutputErrors() {
  for (const int signal : {SIGPIPE, SIGXFSZ}) std::signal(signal, SIG_IGN);
}

bool printLine(std::string_view text) {
  flushOutput();
  return print(printable(text) + "\n");
}

bool printLines(std::string_view text) {
  flushOutput();
  return print(printable(text, true) + "\n");
}

void expectReader() {
  pollfd output{STDOUT_FILENO, 0, 0};
  if (poll(&output, 1, 0) > 0 && (output.revents & POLLERR) != 0) fail(EPIPE);
}

void flushOutput() {
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) fail(errno);
}

}  // namespace traction::client

#include "client/show/terminal.h"

#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <cstring>

namespace traction::client {

namespace {

volatile std::sig_atomic_t stopSignal = 0;  // NOLINT(*-avoid-non-const-global-variables): signals know no objects

bool writeAll(std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = write(STDOUT_FILENO, text.data(), text.size());
    if (written < 0 && errno != EINTR && errno != EAGAIN) return false;
    if (written > 0) text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

bool canBeDrawnOn() {
  const char* name = std::getenv("TERM");
  return name != nullptr && *name != '\0' && std::strcmp(name, "dumb") != 0;
}

Depth depthOfTerminal() {
  const char* none = std::getenv("NO_COLOR");  // https://no-color.org
  if (none != nullptr && *none != '\0') return Depth::kNone;
  const char* colours = std::getenv("COLORTERM");
  const bool direct = colours != nullptr && (std::strstr(colours, "truecolor") || std::strstr(colours, "24bit"));
  return direct ? Depth::kTrueColour : Depth::k256;
}

}  // namespace

bool isTerminal() {
  return isatty(STDOUT_FILENO) != 0 && canBeDrawnOn();
}

std::string viewHint() {
  if (isatty(STDOUT_FILENO) == 0 || canBeDrawnOn()) return "";
  return "TERM says that this terminal cannot be drawn on: one line a second instead of the live view";
}

Terminal::Terminal()
    : depth_(depthOfTerminal()) {
  if (isatty(STDIN_FILENO) && tcgetattr(STDIN_FILENO, &before_) == 0) {
    termios keys = before_;
    keys.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
    keys.c_cc[VSUSP] = _POSIX_VDISABLE;  // a suspended program would leave its screen behind
    hasKeys_ = tcsetattr(STDIN_FILENO, TCSANOW, &keys) == 0;
  }
  writeAll("\x1b[?1049h\x1b[?25l\x1b[?7l");  // alternate screen, no cursor, no wrapping
}

Terminal::~Terminal() {
  writeAll("\x1b[0m\x1b[?7h\x1b[?25h\x1b[?1049l");
  if (hasKeys_) tcsetattr(STDIN_FILENO, TCSANOW, &before_);
}

Terminal::Size Terminal::size() const {
  winsize window{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &window) != 0 || window.ws_col == 0) return {80, 24};
  return {window.ws_col, window.ws_row};
}

bool Terminal::show(const Canvas& canvas) const {
  return writeAll(canvas.render(depth_));
}

char Terminal::waitForKey(std::chrono::milliseconds timeout) const {
  pollfd keys{hasKeys_ ? STDIN_FILENO : -1, POLLIN, 0};
  char key = 0;
  if (poll(&keys, 1, static_cast<int>(timeout.count())) > 0 && read(STDIN_FILENO, &key, 1) == 1) return key;
  return 0;
}

void rememberSignals() {
  struct sigaction action {};
  action.sa_handler = [](int signal) { stopSignal = signal; };
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaction(signal, &action, nullptr);
}

bool stopRequested() {
  return stopSignal != 0;
}

}  // namespace traction::client

// The terminal while a live view is shown on it.
#pragma once

#include "client/show/canvas.h"

#include <termios.h>

#include <chrono>

namespace traction::client {

/// Returns whether standard output is a terminal on which a page can be drawn, by TERM: it is set, and not "dumb".
bool isTerminal();

/// Returns the reason why a live view cannot be drawn on the terminal, for a message to the operator; empty if it can,
/// or if standard output is not a terminal. It is a sentence without a full stop, which also says that one line a
/// second is printed instead: the caller must do that.
std::string viewHint();

/// Owns the screen and the keyboard. Only one object may exist at a time.
class Terminal {
 public:
  /// Switches to the alternate screen, without cursor and line wrapping. If standard input is a terminal, keys are then
  /// read one by one, without echo, and Ctrl-Z is disabled. The environment decides on colours
  /// (NO_COLOR, COLORTERM). Requires isTerminal(). rememberSignals() must have been called, or a signal leaves the
  /// terminal as it is.
  Terminal();
  /// Restores the screen and standard input.
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  struct Size {
    int width, height;
  };
  /// Returns the size in characters; 80 x 24 if it is not known.
  Size size() const;
  /// Writes the page to standard output. Waits without a limit, also after a signal, for a terminal that does not read.
  /// Returns false if it is gone.
  bool show(const Canvas& canvas) const;
  /// Waits for a key and returns its byte. Returns 0 after the timeout and on a signal; if standard input is not a
  /// terminal, after the timeout; if it has ended, at once.
  /// \param timeout negative: no limit
  char waitForKey(std::chrono::milliseconds timeout) const;

 private:
  termios before_{};
  bool hasKeys_ = false;
  Depth depth_;
};

/// Makes SIGINT, SIGTERM and SIGHUP set stopRequested() instead of ending the process. May be called again.
void rememberSignals();
/// Returns whether one of these signals has ever arrived; it is never reset. Requires rememberSignals().
bool stopRequested();

}  // namespace traction::client

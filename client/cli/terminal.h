// The terminal while a live view uses it.
#pragma once

#include "client/cli/canvas.h"

#include <termios.h>

#include <chrono>

namespace traction::cli {

/// Returns whether standard output is a terminal on which a page can be drawn.
bool isTerminal();

/// Returns why a terminal has no live view; empty if it has one, or if standard output is not a terminal.
std::string viewHint();

/// Takes the whole screen, and restores it on destruction. One object at a time.
class Terminal {
 public:
  Terminal();
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  struct Size {
    int width, height;
  };
  /// Returns the size in characters; 80 x 24 if it is not known.
  Size size() const;
  /// Writes the page. Returns false if the terminal is gone.
  bool show(const Canvas& canvas) const;
  /// Returns the characters that the locale supports.
  Glyphs glyphs() const { return glyphs_; }

  /// Waits for a key and returns it; returns 0 after the timeout and on a signal.
  char waitForKey(std::chrono::milliseconds timeout) const;

 private:
  termios before_{};
  bool hasKeys_ = false;
  Depth depth_;
  Glyphs glyphs_;
};

/// Makes SIGINT, SIGTERM and SIGHUP set stopRequested() instead of ending the process.
void rememberSignals();
bool stopRequested();

}  // namespace traction::cli

// The terminal while a live view owns it.
#pragma once

#include "client/cli/canvas.h"

#include <termios.h>

#include <chrono>

namespace traction::cli {

/// Standard output is a terminal on which a page can be drawn.
bool isTerminal();

/// Why there is no live view on a terminal, for people; empty: there is one, or no terminal.
std::string viewHint();

/// Takes the whole screen until it is destroyed; then everything is as before.
class Terminal {
 public:
  Terminal();
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  struct Size {
    int width, height;
  };
  Size size() const;
  /// False: the terminal is gone.
  bool show(const Canvas& canvas) const;
  /// By the locale.
  Glyphs glyphs() const { return glyphs_; }

  /// Sleeps; returns early with the key that was pressed. 0: none, or a signal came.
  char waitForKey(std::chrono::milliseconds timeout) const;

 private:
  termios before_{};
  bool hasKeys_ = false;
  Depth depth_;
  Glyphs glyphs_;
};

/// From now on SIGINT, SIGTERM and SIGHUP are only remembered.
void rememberSignals();
bool stopRequested();

}  // namespace traction::cli

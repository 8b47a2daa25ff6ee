// The terminal while a live view owns it.
#pragma once

#include "client/cli/canvas.h"

#include <termios.h>

#include <chrono>

namespace traction::cli {

/// Standard output is a terminal that shows Unicode.
bool isTerminal();

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
  void show(const Canvas& canvas) const;

  /// Sleeps; returns early with the key that was pressed. 0: none, or a signal came.
  char waitForKey(std::chrono::milliseconds timeout) const;

 private:
  termios before_{};
  bool hasKeys_ = false;
  Depth depth_;
};

/// From now on SIGINT, SIGTERM and SIGHUP are only remembered.
void rememberSignals();
bool stopRequested();

}  // namespace traction::cli

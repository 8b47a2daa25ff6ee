// A program's log: spdlog's lines on standard error, in the form for the journal or for a terminal.
#pragma once

#include <spdlog/common.h>
#include <unistd.h>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace spdlog {
class logger;
}

namespace tractiond {

/// Returns `text` with its prefix: the priority for systemd's journal ("<3>") if logsToJournal(), else "program: ".
/// Adds no line end. The text is made printable().
std::string logLine(std::string_view program, spdlog::level::level_enum level, std::string_view text);

/// spdlog's default logger, whose lines, each a logLine(), a thread of spdlog's writes: no thread that logs waits for
/// the reader. 1,024 lines wait for one that stands still; then the oldest are lost, and a line in their place states
/// how many.
class Log {
 public:
  /// Starts the thread, and replaces spdlog's default logger, which stays after the object.
  /// \throws spdlog::spdlog_ex if no thread can be started
  /// \param level of the lines to write and above: "debug", "info", "warning", "error"; a word that spdlog does not
  /// know: none
  /// \param descriptor must stay open until the process ends
  Log(const std::string& program, const std::string& level, int descriptor = STDERR_FILENO);
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;
  /// Calls drain().
  ~Log();

  /// Waits until the lines until now are written, for half a second at most. One thread at a time.
  void drain();
  /// Returns the number of lines lost since the start: no room, a full disk, or no reader. Any thread.
  std::uint64_t lost() const;

 private:
  class Sink;
  std::shared_ptr<Sink> sink_;
  std::shared_ptr<spdlog::logger> logger_;
};

}  // namespace tractiond

// Checked standard output.
#pragma once

#include <stdexcept>
#include <string_view>

namespace traction::client {

/// Standard output cannot be written; what() is the reason.
class OutputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Makes a closed pipe and a file-size limit errors instead of signals that end the process (ignores SIGPIPE and
/// SIGXFSZ). Must be called once at the start.
void rememberOutputErrors();

/// Flushes stdio, writes a printable() line and its line end at once, and waits for a slow reader without a limit.
/// Returns true when all is written; false if rememberSignals() has recorded a signal, perhaps before the call, which
/// it notices within 0.1 s: the line is then incomplete or missing.
/// \throws OutputError
bool printLine(std::string_view text);
/// Does the same with several lines, of which the last has no line end. What `text` has from elsewhere must be
/// printable() itself, or it may make lines.
/// \throws OutputError
bool printLines(std::string_view text);

/// Checks that standard output, if it is a pipe or socket, still has a reader, also when there is nothing to print.
/// Does not wait.
/// \throws OutputError if it has none
void expectReader();

/// Flushes stdio's standard output.
/// \throws OutputError also if an earlier write to it failed
void flushOutput();

}  // namespace traction::client

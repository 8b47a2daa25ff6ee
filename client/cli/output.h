// Checked standard output.
#pragma once

#include <stdexcept>
#include <string_view>

namespace traction::cli {

/// Standard output cannot be written; what() is the reason.
class OutputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Makes a closed pipe and a file-size limit errors instead of signals that end the process (ignores SIGPIPE and
/// SIGXFSZ). Must be called once at the start.
void rememberOutputErrors();

/// Writes a line and its line end at once, and waits for a slow reader without a limit. Returns false if
/// rememberSignals() has recorded a signal, after 0.1 s at most; the line is then incomplete or missing. \throws
/// OutputError
bool printLine(std::string_view text);

/// Checks that standard output still has a reader, also when there is nothing to print. Does not wait. \throws
/// OutputError
void expectReader();

/// Flushes stdio's standard output. \throws OutputError
void flushOutput();

}  // namespace traction::cli

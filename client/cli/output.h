// Standard output, for those who must know that what they print arrives.
#pragma once

#include <stdexcept>
#include <string_view>

namespace traction::cli {

/// Standard output cannot be written: what() says why.
class OutputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A closed pipe and a file that may not grow are errors like others, not the end of the process. Once, at the start.
void rememberOutputErrors();

/// Writes a line at once, and waits for a slow reader. False: rememberSignals() has seen one meanwhile, and the line is
/// incomplete. \throws OutputError
bool printLine(std::string_view text);

/// \throws OutputError if nobody reads any more, which is noticed here also when there is nothing to print.
void expectReader();

/// Of what stdio has been given. \throws OutputError
void flushOutput();

}  // namespace traction::cli

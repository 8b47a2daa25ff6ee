// Bounds the file descriptors that connections may take. Where descriptors run out, libzmq 4.3.4 aborts the process
// (ipc) or loops without end (TCP), and the program itself can open neither camera nor file. So accept() and accept4()
// of this program are ours, as recv() is (docs/decisions/0031-file-descriptors.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace tractiond::network::connections {

/// Number of file descriptors that connections leave to the program itself.
inline constexpr std::size_t kReserved = 128;
/// No connection has a file descriptor of this number or above, whatever the system allows: tables by descriptor end
/// here.
inline constexpr std::size_t kMostDescriptors = 65'536;

// Every function is thread-safe.

/// Returns the number of connections that were refused since the start of the program.
std::uint64_t refused();

/// Returns whether any connection came through accept() or accept4() of this program: those of ZeroMQ do.
bool seesAccepts();

/// Reports the connections that are refused after its construction. Thread-bound.
class Report {
 public:
  /// \param mostLookedAt number of file descriptors that one call looks at
  explicit Report(std::size_t mostLookedAt = 512)
      : mostLookedAt_(mostLookedAt) {}

  /// Returns a line for the log; empty if nothing was refused, or if the last line was less than a minute ago.
  std::string look(std::int64_t now_ns);

 private:
  std::size_t mostLookedAt_;
  std::uint64_t told_ = refused();
  std::int64_t told_ns_ = 0;
};

}  // namespace tractiond::network::connections

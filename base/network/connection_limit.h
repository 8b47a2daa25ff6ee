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

/// Returns the number of connections that were refused, that is accepted and closed at once, since the start of the
/// program.
std::uint64_t refused();

/// Returns whether accept() or accept4() of this program has been called since its start, with or without success: with
/// a libzmq that uses other calls the limit is not in force.
bool seesAccepts();

/// Reports the connections that are refused after its construction. Thread-bound.
class Report {
 public:
  /// \param mostExamined largest number of file descriptors, above 0, that nextLine() examines for the peer with most
  /// connections; of more it examines every third, fifth ... one, and estimates
  explicit Report(std::size_t mostExamined = 512)
      : mostExamined_(mostExamined) {}

  /// Returns a line for the log, with the number of connections refused since the line before and the peer that has
  /// most connections; empty if nothing was refused since, or if that line is less than a minute old. Does not wait; a
  /// call that returns a line makes some 10 us of system calls for each descriptor. \param now_ns CLOCK_MONOTONIC
  std::string nextLine(std::int64_t now_ns);

 private:
  std::size_t mostExamined_;
  std::uint64_t told_ = refused();
  std::int64_t told_ns_ = 0;
};

}  // namespace tractiond::network::connections

// Reads the frames that a ZeroMQ peer sends (ZMTP 3, RFC 23), and estimates the memory that each costs.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tractiond::network {

/// Kind of frames, which decides how much memory ZeroMQ keeps of them.
enum class Charge {
  kRequests,       ///< messages in a queue until the program takes them
  kSubscriptions,  ///< nodes of a tree, one for each byte, for as long as the connection lasts
};

/// Measures one connection from its first byte on. Ignores the contents of frames, which may be encrypted.
/// Thread-bound.
class FrameMeter {
 public:
  struct Reading {
    std::uint32_t frames = 0;      ///< number of frames that began and that ZeroMQ may keep
    std::uint64_t cost_bytes = 0;  ///< memory for these, as if they had arrived completely
    bool isOld = false;            ///< the peer uses a protocol older than ZMTP 3.0, whose frames cannot be measured
  };

  /// Measures the next bytes of the connection, of any number: frames may begin and end anywhere in them. Returns what
  /// these bytes add, not the sum. After isOld, further readings are the same, without frames. \param bytes need not
  /// outlive the call
  Reading read(std::span<const std::uint8_t> bytes, Charge charge);

 private:
  static constexpr std::size_t kGreeting = 64;

  void count(Reading& reading, Charge charge, bool& pinned) const;

  std::size_t greeting_ = 0;  ///< bytes of it that have arrived
  bool isOld_ = false;
  std::array<std::uint8_t, 9> header_{};
  std::size_t headerSize_ = 0;         ///< bytes of it that have come
  std::uint64_t body_ = 0, left_ = 0;  ///< bytes of the frame's body, and those that have not arrived
  bool undecided_ = false;             ///< a command, whose kind is known by the length of its name
};

}  // namespace tractiond::network

// Reads the frames that a ZeroMQ peer sends (ZMTP 3, RFC 23), and estimates the memory that each costs.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tractiond::network {

/// What frames contain, which decides how much of them ZeroMQ keeps.
enum class Charge {
  kRequests,       ///< messages, in a queue until they are taken
  kSubscriptions,  ///< nodes of a tree, one per byte, until the connection ends
};

/// Measures one connection from its first byte on. Ignores contents, which may be encrypted.
class FrameMeter {
 public:
  struct Reading {
    std::uint32_t frames = 0;      ///< number that began, and may be kept
    std::uint64_t cost_bytes = 0;  ///< memory of these, as if they were complete
    bool isOld = false;            ///< the peer speaks an older protocol than ZMTP 3.0, whose frames this cannot read
  };

  /// Reads the next bytes of the connection.
  Reading read(std::span<const std::uint8_t> bytes, Charge charge);

 private:
  static constexpr std::size_t kGreeting = 64;

  void count(Reading& reading, Charge charge, bool& pinned) const;

  std::size_t greeting_ = 0;  ///< bytes of it that have come
  std::array<std::uint8_t, 9> header_{};
  std::size_t headerSize_ = 0;         ///< bytes of it that have come
  std::uint64_t body_ = 0, left_ = 0;  ///< bytes of the frame's body, and of those that have not come
  bool undecided_ = false;             ///< a command, whose kind is known by the length of its name
};

}  // namespace tractiond::network

// Open Sound Control 1.0 in datagrams: its encoding, and the forces on the gel for music and art programs.
#pragma once

#include "base/error.h"
#include "client/input/affine.h"
#include "client/input/touches.h"

#include <tl/expected.hpp>

#include <cstdint>
#include <initializer_list>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace traction::input {

/// A message: an address, and arguments in the order in which they are added.
class OscMessage {
 public:
  explicit OscMessage(std::string address)
      : address_(std::move(address)) {}

  // These append an argument and return this message.
  OscMessage& add(std::int32_t number);
  OscMessage& add(std::string_view text);
  /// Adds numbers as floats.
  OscMessage& add(std::initializer_list<double> numbers);
  /// Adds a time [ns since 1970].
  OscMessage& addTime(std::int64_t real_ns);

  /// Returns the encoded message.
  std::string bytes() const;

 private:
  std::string address_;
  std::string types_ = ",";
  std::string arguments_;
};

/// Returns the bytes of a bundle that takes effect at once.
std::string bundleOf(const std::vector<OscMessage>& messages);

/// Sends datagrams to one address. What nobody receives is lost.
class Datagrams {
 public:
  /// Makes a socket and resolves the address, which may wait for a name server. EX_CONFIG: the address is not valid;
  /// EX_OSERR: no socket can be made.
  /// \param address "HOST:PORT", or "[HOST]:PORT" for IPv6; of a name that has addresses of both, the first of IPv4.
  /// May be a broadcast address
  static tl::expected<Datagrams, tractiond::Error> open(const std::string& address);
  ~Datagrams();
  Datagrams(Datagrams&& other) noexcept
      : descriptor_(std::exchange(other.descriptor_, -1)) {}

  /// Sends one datagram. Does not wait; a datagram that cannot be sent is lost.
  void send(std::string_view bytes) const;

 private:
  explicit Datagrams(int descriptor)
      : descriptor_(descriptor) {}

  int descriptor_;
};

struct OscOptions {
  std::string address = "127.0.0.1:9000";
  std::string prefix = "/traction";  ///< of all addresses, to tell several gels apart
  double gradientDeadZone_Pa_m = 5e5;
};

/// Sends for each field a bundle of PREFIX/touch for each touch, PREFIX/lift for each that ended, PREFIX/wrench,
/// PREFIX/affine and PREFIX/gesture (docs/input.md); without touches such a bundle each second. As datagrams may be
/// lost, each PREFIX/lift is sent kRepeats times more, once a second.
class OscOutput : public Output {
 public:
  OscOutput(Datagrams datagrams, const OscOptions& options)
      : datagrams_(std::move(datagrams))
      , prefix_(options.prefix)
      , gradientDeadZone_Pa_m_(options.gradientDeadZone_Pa_m) {}

  static constexpr int kRepeats = 5;

  void write(const Touches& touches) override;
  void turn(std::int64_t now_ns) override;

 private:
  /// Sends what is known of the whole gel behind these messages.
  void send(std::vector<OscMessage> messages, const Touches& touches);
  OscMessage liftOf(std::uint64_t id) const;

  Datagrams datagrams_;
  std::string prefix_;
  double gradientDeadZone_Pa_m_;
  Gesture gesture_;
  std::vector<std::uint64_t> open_;      ///< ids of the touches of the last field
  std::map<std::uint64_t, int> lifted_;  ///< how often the end of a touch is to be sent again
  std::int64_t told_ns_ = 0;             ///< turn() that last sent, or had nothing to send
};

}  // namespace traction::input

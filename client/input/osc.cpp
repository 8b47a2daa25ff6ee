#include "client/input/osc.h"

#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <memory>

namespace traction::input {
namespace {

void append(std::string& bytes, std::uint32_t number) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(number >> shift);
}

/// Appends a text with its end, padded to a multiple of four bytes.
void append(std::string& bytes, std::string_view text) {
  bytes += text;
  bytes.append(4 - text.size() % 4, '\0');
}

}  // namespace

OscMessage& OscMessage::add(std::int32_t number) {
  types_ += 'i';
  append(arguments_, static_cast<std::uint32_t>(number));
  return *this;
}

OscMessage& OscMessage::add(std::string_view text) {
  types_ += 's';
  append(arguments_, text);
  return *this;
}

OscMessage& OscMessage::add(std::initializer_list<double> numbers) {
  for (const double number : numbers) {
    types_ += 'f';
    append(arguments_, std::bit_cast<std::uint32_t>(static_cast<float>(number)));
  }
  return *this;
}

OscMessage& OscMessage::addTime(std::int64_t real_ns) {
  constexpr std::uint32_t kFrom1900 = 2'208'988'800;  // to 1970 [s]
  types_ += 't';
  append(arguments_, static_cast<std::uint32_t>(real_ns / 1'000'000'000) + kFrom1900);
  append(arguments_,
         static_cast<std::uint32_t>((static_cast<std::uint64_t>(real_ns % 1'000'000'000) << 32) / 1'000'000'000));
  return *this;
}

std::string OscMessage::bytes() const {
  std::string bytes;
  append(bytes, std::string_view(address_));
  append(bytes, std::string_view(types_));
  return bytes + arguments_;
}

std::string bundleOf(const std::vector<OscMessage>& messages) {
  std::string bytes;
  append(bytes, std::string_view("#bundle"));
  append(bytes, 0U);
  append(bytes, 1U);  // "immediately"
  for (const OscMessage& message : messages) {
    const std::string content = message.bytes();
    append(bytes, static_cast<std::uint32_t>(content.size()));
    bytes += content;
  }
  return bytes;
}

tl::expected<Datagrams, tractiond::Error> Datagrams::open(const std::string& address) {
  const auto wrong = [&](const std::string& why) {
    return tl::unexpected(tractiond::Error{EX_CONFIG, "\"" + address + "\" is no address to send to: " + why, "",
                                           "write HOST:PORT, for example 127.0.0.1:3333"});
  };
  const std::size_t colon = address.rfind(':');
  if (colon == std::string::npos) return wrong("it has no port");
  const char* const end = address.data() + address.size();
  unsigned port = 0;  // of more than 16 bits getaddrinfo() takes the lower ones
  const auto [parsed, failed] = std::from_chars(address.data() + colon + 1, end, port);
  if (failed != std::errc() || parsed != end || port < 1 || port > 65535)
    return wrong("its port is not a number from 1 to 65535");
  std::string host = address.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  addrinfo hints{};
  hints.ai_socktype = SOCK_DGRAM;
  hints.ai_flags = AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int error = getaddrinfo(host.c_str(), address.c_str() + colon + 1, &hints, &found);
  if (error != 0) return wrong(gai_strerror(error));
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> owner(found, freeaddrinfo);
  // Most programs listen for IPv4 only, and the first address of localhost may be ::1.
  const addrinfo* to = found;
  while (to != nullptr && to->ai_family != AF_INET) to = to->ai_next;
  if (to == nullptr) to = found;
  Datagrams datagrams(socket(to->ai_family, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  constexpr int kAdmitted = 1;  // else broadcast addresses are refused
  if (datagrams.descriptor_ < 0 ||
      setsockopt(datagrams.descriptor_, SOL_SOCKET, SO_BROADCAST, &kAdmitted, sizeof kAdmitted) != 0 ||
      connect(datagrams.descriptor_, to->ai_addr, to->ai_addrlen) != 0)
    return tl::unexpected(
        tractiond::Error{EX_OSERR, "datagrams cannot be sent to " + address + ": " + std::strerror(errno), "", ""});
  return datagrams;
}

Datagrams::~Datagrams() {
  if (descriptor_ >= 0) close(descriptor_);
}

void Datagrams::send(std::string_view bytes) const {
  // The first error after nobody has received an earlier datagram is that one's.
  if (::send(descriptor_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL) < 0 && errno == ECONNREFUSED)
    ::send(descriptor_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
}

void OscOutput::write(const Touches& touches) {
  std::vector<OscMessage> messages;
  const std::vector<std::uint64_t> before = std::exchange(open_, {});
  for (const Touch& touch : touches.touches) {
    open_.push_back(touch.id);
    lifted_.erase(touch.id);  // it was lost, and is seen again
    messages.push_back(OscMessage(prefix_ + "/touch")
                           .add(static_cast<std::int32_t>(touch.id))
                           .add({1e3 * touch.position_m[0], 1e3 * touch.position_m[1], touch.shear_N[0],
                                 touch.shear_N[1], touch.press_N, 1e3 * touch.torque_Nm, 1e3 * touch.radius_m}));
  }
  for (const std::uint64_t id : before) {
    if (std::find(open_.begin(), open_.end(), id) != open_.end()) continue;
    messages.push_back(liftOf(id));
    lifted_[id] = kRepeats;
  }
  if (!messages.empty()) send(std::move(messages), touches);
}

void OscOutput::turn(std::int64_t now_ns) {
  if (now_ns - told_ns_ < kRepeat_ns) return;
  told_ns_ = now_ns;
  std::vector<OscMessage> messages;
  for (auto& [id, times] : lifted_) {
    messages.push_back(liftOf(id));
    --times;
  }
  std::erase_if(lifted_, [](const auto& lift) { return lift.second == 0; });
  if (open_.empty())
    send(std::move(messages), {});
  else if (!messages.empty())
    datagrams_.send(bundleOf(messages));
}

OscMessage OscOutput::liftOf(std::uint64_t id) const {
  return std::move(OscMessage(prefix_ + "/lift").add(static_cast<std::int32_t>(id)));
}

void OscOutput::send(std::vector<OscMessage> messages, const Touches& touches) {
  const Wrench& wrench = touches.wrench;
  messages.push_back(OscMessage(prefix_ + "/wrench")
                         .add({wrench[0], wrench[1], wrench[2], 1e3 * wrench[3], 1e3 * wrench[4], 1e3 * wrench[5]}));
  const Gradient& gradient = touches.gradient;
  const auto inUnits = [&](double of_Pa_m) {
    return 1e-6 * beyond(of_Pa_m, gradient.deviation_Pa_m, gradientDeadZone_Pa_m_);
  };
  messages.push_back(
      OscMessage(prefix_ + "/affine")
          .add({inUnits(gradient.dilation_Pa_m), inUnits(gradient.stretch_Pa_m), inUnits(gradient.shear_Pa_m)}));
  const Similarity& motion = gesture_.follow(touches);
  messages.push_back(OscMessage(prefix_ + "/gesture")
                         .add({1e3 * motion.shift_m[0], 1e3 * motion.shift_m[1], motion.turn_rad, motion.scale}));
  datagrams_.send(bundleOf(messages));
}

}  // namespace traction::input

// Packets of a stream, to what reads them without Aravis: [length, two bytes][packet] ...
#include "daemon/capture/packet_survey.h"
#include "daemon/capture/sent_picture.h"
#include "tests/fuzz/target.h"

#include <algorithm>
#include <vector>

namespace fuzz {
namespace {

std::string packet(std::uint8_t kind, std::uint8_t number, std::string body) {
  std::string bytes = {0, 0, 0, 7, static_cast<char>(kind), 0, 0, static_cast<char>(number)};
  bytes += body;
  return std::string{static_cast<char>(bytes.size() >> 8), static_cast<char>(bytes.size())} + bytes;
}

}  // namespace

std::vector<std::string> seeds() {
  std::string leader(36, '\0');
  leader[3] = 1;
  leader[12] = 1, leader[13] = 8, leader[15] = 1;  // Mono8
  leader[19] = 64, leader[23] = 48;
  const std::string data = packet(3, 1, std::string(1000, 'p')) + packet(3, 2, std::string(1000, 'p'));
  return {packet(1, 0, leader) + data + packet(3, 3, "p") + packet(2, 4, std::string(8, '\0'))};
}

bool feed(std::string_view bytes) {
  using namespace tractiond::capture;
  PacketSurvey survey;
  std::size_t longest = 0;
  while (bytes.size() > 2) {
    const std::size_t length =
        static_cast<std::size_t>(static_cast<std::uint8_t>(bytes[0])) << 8 | static_cast<std::uint8_t>(bytes[1]);
    const std::string_view text = bytes.substr(2, length);
    const std::vector<std::uint8_t> packet(text.begin(), text.end());  // with an end of its own
    survey.see(packet, 1);
    longest = std::max(longest, packet.size());
    bytes.remove_prefix(2 + text.size());
  }
  require(survey.block_bytes() <= longest, "a block that is longer than its packet");
  if (!survey.hasLeader()) return false;
  constexpr PictureShape kAgreed{64, 48, 3072, 0x01080001};
  SentPicture sent = survey.picture();
  sent.size = 1 << 20;
  const auto layout = layoutOf(sent, kAgreed);
  require(layout.has_value() == deviation(sent, kAgreed).empty(), "a picture that is refused without a reason");
  require(!layout || std::size_t{47} * static_cast<std::size_t>(layout->stride) + 64 <= sent.size,
          "a row that is not in the buffer");
  return layout.has_value();
}

}  // namespace fuzz

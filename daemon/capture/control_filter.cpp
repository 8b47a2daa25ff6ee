#include "daemon/capture/control_filter.h"

#include <initializer_list>

namespace tractiond::capture {
namespace {

constexpr std::uint32_t kUdpHeader = 8;  // where a socket's filter sees the packet begin
constexpr std::uint32_t kHeader_bytes = 8, kPending_bytes = 12;
constexpr std::uint32_t kAnswered = 0x00, kRefused = 0x80, kRefusedUnknown = 0x8f;
constexpr std::uint32_t kRegisterRead = 0x81, kRegisterWritten = 0x83, kMemoryRead = 0x85, kMemoryWritten = 0x87;
constexpr std::uint32_t kPending = 0x89;

}  // namespace

std::vector<sock_filter> controlFilter(std::uint32_t address, std::uint16_t port) {
  constexpr std::uint8_t kToRefuse = 0xff;  // resolved below
  std::vector<sock_filter> code;
  const auto load = [&](unsigned width, std::uint32_t at) {
    code.push_back({static_cast<std::uint16_t>(BPF_LD | width | BPF_ABS), 0, 0, at});
  };
  /// What was loaded is one of these.
  const auto expect = [&](std::initializer_list<std::uint32_t> values) {
    std::size_t left = values.size();
    for (const std::uint32_t value : values) {
      --left;
      code.push_back(
          {BPF_JMP | BPF_JEQ | BPF_K, static_cast<std::uint8_t>(left), left == 0 ? kToRefuse : std::uint8_t{0}, value});
    }
  };
  const auto expectLength = [&](std::uint32_t least) {
    code.push_back({BPF_LD | BPF_W | BPF_LEN, 0, 0, 0});
    code.push_back({BPF_JMP | BPF_JGE | BPF_K, 0, kToRefuse, kUdpHeader + least});
  };

  load(BPF_W, static_cast<std::uint32_t>(SKF_NET_OFF) + 12);
  expect({address});
  load(BPF_H, 0);
  expect({port});
  expectLength(kHeader_bytes);
  load(BPF_B, kUdpHeader);
  expect({kAnswered, kRefused, kRefusedUnknown});
  load(BPF_H, kUdpHeader + 2);
  expect({kRegisterRead, kRegisterWritten, kMemoryRead, kMemoryWritten, kPending});
  code.push_back({BPF_JMP | BPF_JEQ | BPF_K, 0, 2, kPending});
  expectLength(kPending_bytes);
  code.push_back({BPF_RET | BPF_K, 0, 0, 0xffffffff});
  const std::size_t refuse = code.size();
  code.push_back({BPF_RET | BPF_K, 0, 0, 0});
  for (std::size_t i = 0; i < refuse; ++i)
    if (code[i].jf == kToRefuse) code[i].jf = static_cast<std::uint8_t>(refuse - i - 1);
  return code;
}

}  // namespace tractiond::capture

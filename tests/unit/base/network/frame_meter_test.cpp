#include "base/network/frame_meter.h"
#include "tests/unit/base/network/raw_peer.h"

#include <gtest/gtest.h>

namespace tractiond::network::frame_meter_test {
namespace {

const std::string kGreeting = RawPeer::greeting();
const std::string kReady = RawPeer::command("\5READY");

FrameMeter::Reading operator+(FrameMeter::Reading a, const FrameMeter::Reading& b) {
  return {a.frames + b.frames, a.cost_bytes + b.cost_bytes, a.isOld || b.isOld};
}

/// Reads a whole connection in pieces of so many bytes.
FrameMeter::Reading read(const std::string& sent, Charge charge = Charge::kRequests, std::size_t piece = 8192) {
  FrameMeter meter;
  FrameMeter::Reading sum;
  for (std::size_t at = 0; at < sent.size(); at += piece) {
    const std::string part = sent.substr(at, piece);
    sum = sum + meter.read({reinterpret_cast<const std::uint8_t*>(part.data()), part.size()}, charge);
  }
  return sum;
}

std::string longFrame(char flags, std::size_t size) {
  std::string header(9, '\0');
  header[0] = static_cast<char>(flags | 2);
  for (std::size_t i = 0; i < 8; ++i) header[8 - i] = static_cast<char>(size >> 8 * i);
  return header + std::string(size, 'x');
}

TEST(FrameMeter, HandshakeIsFree) {
  const auto reading = read(kGreeting + kReady);
  EXPECT_EQ(reading.frames, 0U);
  EXPECT_EQ(reading.cost_bytes, 0U);
  EXPECT_FALSE(reading.isOld);
}

TEST(FrameMeter, FramesAreTheSameHoweverTheyAreSplit) {
  const std::string sent = kGreeting + kReady + RawPeer::part("") + longFrame(1, 300) + RawPeer::message("abc") +
                           RawPeer::command(std::string("\4PING\0\0", 7)) + longFrame(0, 70'000) + RawPeer::message("");
  for (const std::size_t piece : {1, 2, 7, 64, 65, 4096, 100'000}) {
    const auto reading = read(sent, Charge::kRequests, piece);
    EXPECT_EQ(reading.frames, 5U) << piece;
    EXPECT_GT(reading.cost_bytes, 70'000U + 300U + 5 * 64U) << piece;
    EXPECT_LT(reading.cost_bytes, 70'000U + 3 * 8192U + 300U + 5 * 65U) << piece;
  }
}

TEST(FrameMeter, AFrameCostsWhatItSaysBeforeItHasCome) {
  EXPECT_GT(read(kGreeting + kReady + longFrame(0, 60'000).substr(0, 9)).cost_bytes, 60'000U);
  // Whatever length is stated: sums do not overflow.
  EXPECT_GT(read(kGreeting + '\2' + std::string(8, '\xff')).cost_bytes, 1U << 20);
}

TEST(FrameMeter, EmptyPartsCostMoreThanTheyHaveBytes) {
  std::string parts;
  for (int i = 0; i < 1000; ++i) parts += RawPeer::part("");
  EXPECT_EQ(read(kGreeting + kReady + parts).cost_bytes, 64'000U);
}

TEST(FrameMeter, OnlyCommandsThatZeroMqKeepsNothingOfAreFree) {
  const auto framesOf = [](const std::string& sent) { return read(kGreeting + sent).frames; };
  EXPECT_EQ(framesOf(RawPeer::command("\4PING")), 0U);
  EXPECT_EQ(framesOf(RawPeer::command("\10INITIATE")), 0U);
  EXPECT_EQ(framesOf(RawPeer::command("\11SUBSCRIBEa")), 1U);
  EXPECT_EQ(framesOf(RawPeer::command("\6CANCELa")), 1U);
  EXPECT_EQ(framesOf(RawPeer::command("\7MESSAGE")), 1U);
  EXPECT_EQ(framesOf(RawPeer::command("")), 1U);
  EXPECT_EQ(framesOf('\5' + RawPeer::command("\4PING").substr(1)), 1U) << "a part of a message that goes on";
  std::string large = longFrame(4, 60'000);
  large[9] = '\4';
  EXPECT_EQ(framesOf(large), 1U) << "it is allocated before it is dropped";
}

TEST(FrameMeter, SubscriptionsCostANodeForEachByte) {
  const std::string sent = kGreeting + RawPeer::message("\1" + std::string(29, 'x'));
  EXPECT_EQ(read(sent, Charge::kRequests).cost_bytes, 64U + 30U);
  EXPECT_EQ(read(sent, Charge::kSubscriptions).cost_bytes, 64U + 2048U + 40U * 30U);
}

TEST(FrameMeter, OlderProtocolsAreTold) {
  std::string two = kGreeting;
  two[10] = 1;  // ZMTP 2.0
  EXPECT_TRUE(read(two).isOld);
  EXPECT_TRUE(read(two, Charge::kRequests, 1).isOld);
  EXPECT_TRUE(read(std::string("\1\0", 2)).isOld) << "ZMTP 1.0";
  std::string one = kGreeting;
  one[9] = '\0';  // ZMTP 1.0, too: a long message
  EXPECT_TRUE(read(one).isOld);
  FrameMeter meter;
  const auto add = [&](const std::string& bytes) {
    return meter.read({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, Charge::kRequests);
  };
  EXPECT_TRUE(add(two).isOld);
  const FrameMeter::Reading after = add(std::string(1000, '\0'));
  EXPECT_TRUE(after.isOld);
  EXPECT_EQ(after.frames, 0U);
  EXPECT_EQ(after.cost_bytes, 0U);
  std::string newer = kGreeting;
  newer[10] = 4;
  EXPECT_FALSE(read(newer).isOld);
}

}  // namespace
}  // namespace tractiond::network::frame_meter_test

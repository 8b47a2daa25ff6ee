// Messages and bundles as OSC 1.0 and TUIO have them.
#include "client/input/osc.h"
#include "client/input/tuio.h"
#include "tests/unit/input/touches.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

namespace traction::input::test {
namespace {

std::string operator""_bytes(const char* text, std::size_t size) {
  return {text, size};
}

/// A program that listens at all addresses of IPv4 of this machine.
class Receiver {
 public:
  Receiver() {
    sockaddr_in any{};
    any.sin_family = AF_INET;
    socklen_t size = sizeof any;
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&any), size), 0);
    EXPECT_EQ(getsockname(socket_, reinterpret_cast<sockaddr*>(&any), &size), 0);
    port_ = ":" + std::to_string(ntohs(any.sin_port));
  }
  Receiver(const Receiver&) = delete;
  ~Receiver() { close(socket_); }

  Datagrams from(const std::string& host) const {
    auto datagrams = Datagrams::open(host + port_);
    EXPECT_TRUE(datagrams) << datagrams.error().what;
    return *std::move(datagrams);
  }

  /// Returns all datagrams that came.
  std::vector<std::string> all() const {
    from("127.0.0.1").send("end");
    std::vector<std::string> datagrams;
    for (std::array<char, 2000> bytes{};;) {
      pollfd came{.fd = socket_, .events = POLLIN, .revents = 0};
      if (poll(&came, 1, 60'000) != 1) return datagrams.emplace_back("silence"), datagrams;
      const ssize_t size = recv(socket_, bytes.data(), bytes.size(), 0);
      datagrams.emplace_back(bytes.data(), static_cast<std::size_t>(size));
      if (datagrams.back() == "end") return datagrams.pop_back(), datagrams;
    }
  }

 private:
  int socket_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  std::string port_;
};

TEST(Osc, EncodesTheExamplesOfTheSpecification) {
  EXPECT_EQ(OscMessage("/oscillator/4/frequency").add({440.0}).bytes(),
            "/oscillator/4/frequency\0,f\0\0\x43\xdc\0\0"_bytes);
  EXPECT_EQ(OscMessage("/foo").add(1000).add(-1).add("hello").add({1.234, 5.678}).bytes(),
            "/foo\0\0\0\0,iisff\0\0\0\0\x03\xe8\xff\xff\xff\xffhello\0\0\0\x3f\x9d\xf3\xb6\x40\xb5\xb2\x2d"_bytes);
  EXPECT_EQ(bundleOf({OscMessage("/a")}), "#bundle\0\0\0\0\0\0\0\0\1\0\0\0\x08/a\0\0,\0\0\0"_bytes);
  EXPECT_EQ(OscMessage("/t").addTime(1'500'000'000).bytes(), "/t\0\0,t\0\0\x83\xaa\x7e\x81\x80\0\0\0"_bytes);
}

TEST(Osc, RefusesWhatIsNoAddressToSendTo) {
  for (const char* const address :
       {"localhost", "127.0.0.1:", "127.0.0.1:port", "127.0.0.1:99999", "127.0.0.1:0", "no.such.host.invalid:1"}) {
    const auto datagrams = Datagrams::open(address);
    ASSERT_FALSE(datagrams) << address;
    EXPECT_EQ(datagrams.error().exitCode, EX_CONFIG);
  }
  EXPECT_TRUE(Datagrams::open("[::1]:3333") || Datagrams::open("127.0.0.1:3333"));
}

TEST(Osc, ReachesWhoListensForIPv4AtANameAndAtABroadcastAddress) {
  const Receiver receiver;
  for (const char* const host : {"localhost", "127.255.255.255"}) receiver.from(host).send(host);
  const std::vector<std::string> came = receiver.all();
  std::printf("  sent to localhost and to a broadcast address: %zu datagrams came; right: 2\n", came.size());
  EXPECT_EQ(came, (std::vector<std::string>{"localhost", "127.255.255.255"}));
}

TEST(Osc, RepeatsForSomeSecondsThatATouchWasLiftedAndAlwaysThatNoneIsThere) {
  const Receiver receiver;
  OscOutput output(receiver.from("127.0.0.1"), {.address = "", .prefix = "/gel", .gradientDeadZone_Pa_m = 0.0});
  const auto told = [&](const std::string& bytes) {  // how many datagrams have these bytes
    const auto datagrams = receiver.all();
    return std::count_if(datagrams.begin(), datagrams.end(),
                         [&](const std::string& one) { return one.find(bytes) != std::string::npos; });
  };
  output.write(fieldOf({touchOf(1, 0.0, 0.0), touchOf(2, 0.01, 0.0)}));
  output.write(fieldOf({touchOf(2, 0.01, 0.0)}, 2 * kFrame_ns));
  EXPECT_EQ(told(OscMessage("/gel/lift").add(1).bytes()), 1);
  for (int turn = 1; turn <= 100; ++turn) output.turn(kRepeat_ns + turn * kRepeat_ns / 10);
  const auto again = told(OscMessage("/gel/lift").add(1).bytes());
  std::printf("  OSC, 10 s after a touch of two was lifted: told %td times again; right: 5\n", again);
  EXPECT_EQ(again, OscOutput::kRepeats);
  output.write(fieldOf({}, 3 * kFrame_ns));
  EXPECT_EQ(told(OscMessage("/gel/lift").add(2).bytes()), 1);
  for (int turn = 1; turn <= 100; ++turn) output.turn(11 * kRepeat_ns + turn * kRepeat_ns / 10);
  EXPECT_EQ(told(OscMessage("/gel/wrench").add({0.0, 0.0, 0.0, 0.0, 0.0, 0.0}).bytes()), 10);
}

TEST(Tuio, RepeatsOnceASecondThatNothingTouches) {
  for (const auto version : {TuioOutput::Version::k11, TuioOutput::Version::k20}) {
    const bool isFirst = version == TuioOutput::Version::k11;
    const Receiver receiver;
    TuioOutput output(receiver.from("127.0.0.1"), version, {}, 10.0);
    std::int64_t now_ns = 0;
    const auto seconds = [&](int count) {
      for (int turn = 0; turn < 10 * count; ++turn) output.turn(now_ns += kRepeat_ns / 10);
      return receiver.all();
    };
    output.write(fieldOf({touchOf(1, 0.0, 0.0)}));
    EXPECT_EQ(seconds(3).size(), 1U) << "fields tell of the touch";
    output.write(fieldOf({}, 2 * kFrame_ns));
    const std::vector<std::string> told = seconds(3);
    std::printf("  TUIO %s, 3 s after the last lift: told %zu times; right: 4\n", isFirst ? "1.1" : "2.0", told.size());
    ASSERT_EQ(told.size(), 4U);
    const std::string alive = (isFirst ? OscMessage("/tuio/2Dcur").add("alive") : OscMessage("/tuio2/alv")).bytes();
    for (const std::string& each : told) EXPECT_NE(each.find(alive), std::string::npos);
    // Receivers ignore frames below those of before, but not -1.
    const std::string again = OscMessage("/tuio/2Dcur").add("fseq").add(-1).bytes();
    const auto frameOf = [](const std::string& bundle) { return bundle.substr(bundle.find(",itis") + 8, 4); };
    for (std::size_t i = 1; i < told.size(); ++i) {
      if (isFirst) EXPECT_NE(told[i].find(again), std::string::npos);
      if (!isFirst) EXPECT_GT(frameOf(told[i]), frameOf(told[i - 1]));
    }
  }
}

TEST(Tuio, PlacesAreFractionsFromTheUpperLeftCorner) {
  const Area area{{0.06, 0.03}};
  EXPECT_EQ(area.fractions({-0.03, 0.015}), (std::array{0.0, 0.0}));
  EXPECT_EQ(area.fractions({0.015, 0.0}), (std::array{0.75, 0.5}));
  EXPECT_EQ(area.fractions({1.0, -1.0}), (std::array{1.0, 1.0}));
}

TEST(Tuio, ABundleListsWhatIsAliveAndLastItsNumber) {
  const Area area;
  const Touches two = fieldOf({touchOf(3, 0.0, 0.0), touchOf(5, 0.01, 0.0)});
  const auto touched = tuio11(two, motionsOf(two, {}, area, 10.0), area, 9);
  ASSERT_EQ(touched.size(), 5U);
  EXPECT_EQ(touched[1].bytes(), OscMessage("/tuio/2Dcur").add("alive").add(3).add(5).bytes());
  EXPECT_EQ(touched[2].bytes(), OscMessage("/tuio/2Dcur").add("set").add(3).add({0.5, 0.5, 0.0, -0.0, 0.0}).bytes());
  EXPECT_EQ(touched[4].bytes(), OscMessage("/tuio/2Dcur").add("fseq").add(9).bytes());
  const auto lifted = tuio20(fieldOf({}), {}, area, 10, 0);
  ASSERT_EQ(lifted.size(), 2U);
  EXPECT_EQ(lifted[1].bytes(), OscMessage("/tuio2/alv").bytes());
}

TEST(Tuio, SpeedsAndAccelerationsAreThoseOfTheTouchInSizesOfTheArea) {
  // Away from the user from rest at 0.03 m/s^2 for a second, while the press grows by 8 N/s^2 from nothing.
  const Area area{{0.06, 0.03}};
  Motions motions;
  Touches field;
  for (int frame = 0; frame <= 60; ++frame) {
    const double time_s = frame / 60.0;
    Touch touch = touchOf(4, 0.0, 0.0, 4.0 * time_s * time_s);
    touch.velocity_m_s = {0.0, 0.03 * time_s};
    touch.seen = frame % 10 != 5;
    if (!touch.seen) touch.press_N = 0.0;
    field = fieldOf({touch}, (1 + frame) * kFrame_ns);
    motions = motionsOf(field, motions, area, 10.0);
  }
  const Motion& motion = motions.at(4);
  EXPECT_DOUBLE_EQ(motion.velocity[1], -1.0);
  EXPECT_NEAR(motion.acceleration, 1.0, 0.02);
  EXPECT_NEAR(motion.pressSpeed, 0.8, 0.05);  // as it was 50 ms ago
  EXPECT_NEAR(motion.pressAcceleration, 0.8, 0.02);
  const auto pointer = tuio20(field, motions, area, 1, 0).at(1).bytes();
  EXPECT_NE(pointer.find(",iiifffffffffff\0"_bytes), std::string::npos);
  EXPECT_TRUE(motionsOf(fieldOf({}), motions, area, 10.0).empty());
}

}  // namespace
}  // namespace traction::input::test

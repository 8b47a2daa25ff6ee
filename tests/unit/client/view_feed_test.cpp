// What feeds the viewer's page: sources that are live, and recordings.
#include "client/viewer/playing.h"
#include "client/viewer/source.h"
#include "tests/support/deadline.h"

#include <gtest/gtest.h>
#include <zmq.hpp>

#include <atomic>
#include <cmath>
#include <limits>

namespace traction::view {
namespace {

using namespace std::chrono_literals;

TEST(Source, HasItsTurnsAlsoAmongBadMessagesAlone) {
  zmq::context_t context;
  zmq::socket_t publisher(context, zmq::socket_type::pub);
  publisher.set(zmq::sockopt::linger, 0);
  publisher.bind("tcp://127.0.0.1:*");
  SubscriberOptions options;
  options.endpoint = publisher.get(zmq::sockopt::last_endpoint);
  std::atomic<int> failures{0}, turns{0};
  const Source source(options, {.pass = [](const Message&, const Raw&) {},
                                .turn = [&](bool) { turns += failures > 0 ? 1 : 0; },
                                .fail = [&](const Error&, const Raw&) { ++failures; }});
  EXPECT_TRUE(tractiond::test::eventually([&] {
    for (int i = 0; i < 100; ++i) {
      publisher.send(zmq::str_buffer("traction/v1/gel/field/"), zmq::send_flags::sndmore);
      publisher.send(zmq::str_buffer("\xff\xff\xff\xff"));
    }
    return failures > 1000;
  }));
  EXPECT_GT(turns, 100);
}

TEST(Playing, TimeOfAMomentIsLimited) {
  constexpr std::uint64_t kSecond = 1'000'000'000;
  EXPECT_EQ(timeToPlay(3 * kSecond, 2.0), 1500ms);
  EXPECT_EQ(timeToPlay(0, 1e-300), 0s);
  for (const double speed : {1e-10, 5e-324, 0.0, -1.0, std::nan("")}) EXPECT_EQ(timeToPlay(kSecond, speed), 24h * 365);
  for (const double speed : {0.0, -0.0, -1.0, std::nan("")}) EXPECT_EQ(timeToPlay(0, speed), 24h * 365);
  EXPECT_EQ(timeToPlay(std::numeric_limits<std::uint64_t>::max(), 1.0), 24h * 365);
  EXPECT_EQ(timeToPlay(kSecond, std::numeric_limits<double>::infinity()), 0s);
}

}  // namespace
}  // namespace traction::view

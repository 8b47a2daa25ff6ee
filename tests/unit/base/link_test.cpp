#include "base/link.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

namespace tractiond::link_test {
namespace {

using namespace std::chrono_literals;

struct Parcel {
  std::uint64_t number = 0;
  std::array<std::uint64_t, 16> copies{};  // all equal to number unless torn

  void fill(std::uint64_t n) {
    number = n;
    copies.fill(n);
  }
  bool whole() const {
    return std::all_of(copies.begin(), copies.end(), [this](auto copy) { return copy == number; });
  }
};

TEST(Ring, IsFirstInFirstOutAndBounded) {
  Ring<int, 4> ring;
  std::array<int, 5> items{};
  EXPECT_EQ(ring.pop(), nullptr);
  for (std::size_t round = 0; round < 3; ++round) {
    for (std::size_t i = 0; i < 4; ++i) EXPECT_TRUE(ring.push(&items[i]));
    EXPECT_FALSE(ring.push(&items[4]));
    for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(ring.pop(), &items[i]);
    EXPECT_EQ(ring.pop(), nullptr);
  }
}

TEST(Link, DiscardsWhatIsStillOnItsWay) {
  Counter evicted;
  int reclaimed = 0;
  Link<int, 5> link(WhenFull::kEvictOldest, evicted, 0, [&](int&) { ++reclaimed; });
  for (int n = 0; n < 3; ++n) link.push(link.acquire());
  link.release(link.take());
  EXPECT_EQ(link.discard(), 2U);
  EXPECT_EQ(reclaimed, 3);
}

TEST(Link, WakesItsConsumerForAPushAndForTheEnd) {
  Counter evicted;
  Link<int, 3> link(WhenFull::kEvictOldest, evicted);
  link.push(link.acquire());
  link.wait(10s);  // returns at once
  EXPECT_NE(link.take(), nullptr);
  link.close();
  link.wait(10s);
  EXPECT_TRUE(link.closed());
  EXPECT_EQ(link.take(), nullptr);
}

// Every parcel arrives once, whole and in order, or is counted as evicted; every slot comes back.
template <std::size_t kSlots>
void runThroughLink(WhenFull whenFull, std::uint64_t count, int consumerEvery) {
  Counter evicted;
  std::uint64_t reclaimed = 0;
  Link<Parcel, kSlots> link(whenFull, evicted, {}, [&](Parcel&) { ++reclaimed; });
  std::uint64_t taken = 0;
  bool wholeAndInOrder = true;
  std::thread consumer([&] {
    std::uint64_t last = 0;
    for (;;) {
      const bool closed = link.closed();
      Parcel* slot = link.take();
      if (!slot && closed) break;
      if (!slot) {
        link.wait(1000ms);
        continue;
      }
      wholeAndInOrder = wholeAndInOrder && slot->whole() && slot->number > last;
      last = slot->number;
      if (consumerEvery > 0 && last % static_cast<unsigned>(consumerEvery) == 0) std::this_thread::yield();
      link.release(slot);
      ++taken;
    }
  });
  for (std::uint64_t n = 1; n <= count; ++n) {
    Parcel* slot = link.acquire();
    for (; !slot; slot = link.acquire()) link.waitForRoom(1000ms);
    slot->fill(n);
    link.push(slot);
  }
  link.close();
  consumer.join();
  EXPECT_TRUE(wholeAndInOrder);
  EXPECT_EQ(taken + evicted.get(), count);
  EXPECT_EQ(link.discard(), 0U);
  EXPECT_EQ(reclaimed, count);
  if (whenFull == WhenFull::kWait) {
    EXPECT_EQ(evicted.get(), 0U);
  }
}

TEST(Link, LosesNothingUncountedUnderStress) {
  runThroughLink<3>(WhenFull::kEvictOldest, 200'000, 7);
  runThroughLink<6>(WhenFull::kEvictOldest, 200'000, 7);
}
TEST(Link, LosesNothingAtAllWhenItWaits) {
  runThroughLink<4>(WhenFull::kWait, 100'000, 5);
}

}  // namespace
}  // namespace tractiond::link_test

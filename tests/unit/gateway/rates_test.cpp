#include "gateway/rates.h"

#include <gtest/gtest.h>

namespace tractiond::gateway::rates_test {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

TEST(RequestLimit, HoldsForEachAndForAll) {
  RequestLimit limit(5, 3);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(limit.beyond("ada", 10 * kSecond_ns), 0);
  EXPECT_EQ(limit.beyond("ada", 10 * kSecond_ns), 3);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(limit.beyond("bob", 10 * kSecond_ns), 0);
  EXPECT_EQ(limit.beyond("bob", 11 * kSecond_ns - 1), 5) << "what was refused does not count";
  EXPECT_EQ(limit.beyond("ada", 11 * kSecond_ns), 0) << "a second is over";
}

TEST(SeldomLine, SaysHowManyOthersThereWere) {
  SeldomLine line;
  EXPECT_EQ(line.next("a", 0), "a");
  EXPECT_EQ(line.next("b", 4 * kSecond_ns), "");
  EXPECT_EQ(line.next("c", 4 * kSecond_ns), "");
  EXPECT_EQ(line.next("d", 5 * kSecond_ns), "d (and 2 like it before)");
  EXPECT_EQ(line.next("e", 20 * kSecond_ns), "e");
}

}  // namespace
}  // namespace tractiond::gateway::rates_test

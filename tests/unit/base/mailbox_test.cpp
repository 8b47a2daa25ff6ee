#include "base/loan.h"
#include "base/mailbox.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

namespace tractiond::mailbox_test {
namespace {

TEST(Mailbox, IsSwappedOnce) {
  Mailbox<std::vector<int>> box;
  std::vector<int> value(3, 7);
  EXPECT_FALSE(box.swap(value));
  EXPECT_EQ(value, std::vector<int>(3, 7));
  EXPECT_TRUE(box.put({1, 2}));
  EXPECT_TRUE(box.swap(value));
  EXPECT_EQ(value, (std::vector<int>{1, 2}));
  EXPECT_FALSE(box.swap(value));
  EXPECT_TRUE(box.put({3}));
  EXPECT_TRUE(box.take(value));
  EXPECT_EQ(value, std::vector<int>(1, 3));
}

TEST(Mailbox, NothingIsTornBetweenThreads) {
  constexpr int kLast = 20000;
  Mailbox<std::vector<int>> box(std::vector<int>(64));
  std::thread putter([&box] {
    std::vector<int> value(64);
    for (int i = 1; i <= kLast; ++i) {
      std::fill(value.begin(), value.end(), i);
      while (!box.put(value)) {
        if (i < kLast) break;  // only the last must arrive
      }
    }
  });
  std::vector<int> value(64);
  int newest = 0;
  while (newest < kLast) {
    if (!box.take(value)) continue;
    for (const int element : value) ASSERT_EQ(element, value[0]);
    ASSERT_GT(value[0], newest);
    newest = value[0];
  }
  putter.join();
}

TEST(Loan, ComesBackAsItWasFilled) {
  constexpr int kLoans = 20000;
  Loan<std::vector<int>> loan;
  std::thread filler([&loan] {
    for (int i = 1; i <= kLoans;) {
      std::vector<int>* const record = loan.lent();
      if (!record) continue;
      for (int& element : *record) element = -element;
      loan.giveBack();
      ++i;
    }
  });
  for (int i = 1; i <= kLoans; ++i) {
    loan.own()->assign(64, i);
    loan.lend();
    while (!loan.own()) std::this_thread::yield();
    EXPECT_EQ(*loan.own(), std::vector<int>(64, -i));
  }
  filler.join();
}

}  // namespace
}  // namespace tractiond::mailbox_test

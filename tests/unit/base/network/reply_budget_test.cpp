#include "base/network/reply_budget.h"

#include <gtest/gtest.h>

#include <set>

namespace tractiond::network::reply_budget_test {
namespace {

class Budget : public testing::Test {
 protected:
  std::set<int> unread_;
  int looks_ = 0;
  ReplyBudget budget_{1000, 300, [this](int fd) {
                        ++looks_;
                        return unread_.contains(fd);
                      }};
};

TEST_F(Budget, IsOfEachAndOfAll) {
  EXPECT_TRUE(budget_.allows("ada", 300));
  (void)budget_.add("ada", 1, 200);
  EXPECT_TRUE(budget_.allows("ada", 100));
  EXPECT_FALSE(budget_.allows("ada", 101));
  for (const char* other : {"bob", "eve", "dan"}) (void)budget_.add(other, 2, 250);
  EXPECT_TRUE(budget_.allows("bob", 50));
  EXPECT_FALSE(budget_.allows("bob", 51)) << "950 wait";
}

TEST_F(Budget, RepliesThatWaitAreCountedOnceHoweverLongTheyDo) {
  (void)budget_.add("ada", 1, 200);
  (void)budget_.add("bob", 2, 50);
  for (int i = 0; i < 10; ++i) budget_.forgetRead();
  EXPECT_TRUE(budget_.allows("bob", 250));
}

TEST_F(Budget, OneOfAnySizeMayWait) {
  EXPECT_TRUE(budget_.allows("ada", 5000));
  (void)budget_.add("ada", 1, 5000);
  EXPECT_FALSE(budget_.allows("ada", 1));
  EXPECT_TRUE(budget_.allows("bob", 5000)) << "nobody is kept from asking by others";
}

TEST_F(Budget, WaitsUntilItIsReadAndNotOnlyWritten) {
  const auto reply = budget_.add("ada", 7, 300);
  unread_ = {7};
  budget_.forgetRead();
  EXPECT_FALSE(budget_.allows("ada", 1));
  reply->queued = false;
  budget_.forgetRead();
  EXPECT_FALSE(budget_.allows("ada", 1)) << "the kernel holds it";
  unread_ = {8};
  budget_.forgetRead();
  EXPECT_TRUE(budget_.allows("ada", 300));
}

TEST_F(Budget, RepliesOfOneConnectionAreAddedUp) {
  const auto first = budget_.add("ada", 7, 100), second = budget_.add("ada", 7, 100);
  unread_ = {7};
  first->queued = false;
  budget_.forgetRead();
  EXPECT_TRUE(budget_.allows("ada", 100));
  EXPECT_FALSE(budget_.allows("ada", 101));
  unread_ = {};
  budget_.forgetRead();
  EXPECT_TRUE(budget_.allows("ada", 200));
  EXPECT_FALSE(budget_.allows("ada", 201)) << "the second one is queued";
  second->queued = false;
  budget_.forgetRead();
  EXPECT_TRUE(budget_.allows("ada", 5000)) << "none waits";
}

/// What a request costs must not grow with the replies that wait: a flood of requests would else take all of a
/// processor.
TEST_F(Budget, AConnectionIsLookedAtOnceInATurn) {
  unread_ = {7, 8};
  for (int i = 0; i < 100; ++i) budget_.add("ada", 7 + i % 2, 1)->queued = false;
  budget_.forgetRead();
  EXPECT_EQ(looks_, 2);
  for (int i = 0; i < 100; ++i) {
    EXPECT_TRUE(budget_.allows("ada", 1));
    (void)budget_.add("ada", 7, 1);
  }
  EXPECT_EQ(looks_, 2);
}

}  // namespace
}  // namespace tractiond::network::reply_budget_test

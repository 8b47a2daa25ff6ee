#include "daemon/publish/reply_budget.h"

#include <gtest/gtest.h>

#include <set>

namespace tractiond::publish::reply_budget_test {
namespace {

class Budget : public testing::Test {
 protected:
  std::set<int> unread_;
  ReplyBudget budget_{1000, 300, [this](int fd) { return unread_.contains(fd); }};
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

TEST_F(Budget, OneOfAnySizeMayWait) {
  EXPECT_TRUE(budget_.allows("ada", 5000));
  (void)budget_.add("ada", 1, 5000);
  EXPECT_FALSE(budget_.allows("ada", 1));
  EXPECT_TRUE(budget_.allows("bob", 5000)) << "nobody is kept from asking by others";
}

TEST_F(Budget, WaitsUntilItIsReadAndNotOnlyWritten) {
  const auto reply = budget_.add("ada", 7, 300);
  unread_ = {7};
  EXPECT_FALSE(budget_.allows("ada", 1));
  reply->queued = false;
  EXPECT_FALSE(budget_.allows("ada", 1)) << "the kernel holds it";
  unread_ = {8};
  EXPECT_TRUE(budget_.allows("ada", 300));
}

}  // namespace
}  // namespace tractiond::publish::reply_budget_test

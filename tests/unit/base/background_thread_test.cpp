#include "base/background_thread.h"

#include <gtest/gtest.h>

#include <vector>

namespace tractiond::background_thread_test {
namespace {

TEST(BackgroundThread, WorksInTheOrderGivenAndReturnsWhatTheWorkReturns) {
  std::vector<int> order;
  BackgroundThread thread("test");
  std::promise<void> begin;
  thread.run([begun = begin.get_future().share()] { begun.wait(); });
  std::vector<std::future<int>> results;
  for (int i = 0; i < 3; ++i) {
    results.push_back(thread.start([&order, i] {
      order.push_back(i);
      return 10 * i;
    }));
  }
  EXPECT_FALSE(thread.awaitIdle(std::chrono::milliseconds(0)));
  begin.set_value();
  for (int i = 0; i < 3; ++i) EXPECT_EQ(results[static_cast<std::size_t>(i)].get(), 10 * i);
  thread.awaitIdle();
  EXPECT_EQ(order, (std::vector<int>{0, 1, 2}));
}

}  // namespace
}  // namespace tractiond::background_thread_test

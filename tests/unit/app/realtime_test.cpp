#include "daemon/app/realtime.h"
#include "tests/support/captured_log.h"
#include "traction/v1/status.pb.h"

#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <latch>
#include <map>
#include <set>
#include <thread>

namespace tractiond::realtime_test {
namespace {

std::set<int> setOf(const cpu_set_t& cpus) {
  std::set<int> result;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(cpu, &cpus)) result.insert(cpu);
  }
  return result;
}

TEST(Cpus, AreReadAndWrittenAsTheKernelDoes) {
  const struct {
    std::string text;
    std::set<int> meant;
    std::string written;
  } cases[] = {{"", {}, ""},           {"0", {0}, "0"},
               {"7-7", {7}, "7"},      {"3,1-2", {1, 2, 3}, "1-3"},
               {"1,0", {0, 1}, "0-1"}, {"10-12,11-14,0,1023", {0, 10, 11, 12, 13, 14, 1023}, "0,10-14,1023"}};
  for (const auto& [text, meant, written] : cases) {
    const auto cpus = parseCpus(text);
    ASSERT_TRUE(cpus) << text;
    EXPECT_EQ(setOf(*cpus), meant) << text;
    EXPECT_EQ(cpusText(*cpus), written);
  }
}

/// The threads of a status, by their names.
std::map<std::string, traction::v1::ThreadScheduling> threadsOf(Realtime& realtime) {
  traction::v1::Scheduling status;
  realtime.read(status);
  std::map<std::string, traction::v1::ThreadScheduling> threads;
  for (const auto& thread : status.threads()) threads.emplace(thread.name(), thread);
  return threads;
}

/// A thread that enters, and stays until the test is over. What the kernel grants of a priority, and of locked memory:
/// tests/system/realtime_test.py.
class Member {
 public:
  Member(Realtime& realtime, const char* name)
      : thread_([&, name] {
        pthread_setname_np(pthread_self(), name);
        realtime.enter();
        entered_.count_down();
        leave_.wait();
        realtime.leave();
      }) {
    entered_.wait();
  }
  ~Member() { leave_.count_down(); }

 private:
  std::latch entered_{1}, leave_{1};
  std::jthread thread_;
};

TEST(Realtime, ProcessorsAreThoseThatThereAre) {
  cpu_set_t own;
  ASSERT_EQ(sched_getaffinity(0, sizeof own, &own), 0);
  const std::set<int> all = setOf(own);
  const int one = *all.rbegin();
  const std::string before = cpusText(own);
  const std::string single = std::to_string(one);
  const struct {
    std::string asked, granted;
    bool warned;
  } cases[] = {{"", before, false}, {single, single, false}, {single + ",1023", single, true}, {"1023", before, true}};
  for (const auto& [asked, granted, warned] : cases) {
    SCOPED_TRACE(asked);
    Realtime realtime({.cpus = asked});
    const test::CapturedLog log;
    Member member(realtime, "member");
    EXPECT_EQ(threadsOf(realtime)["member"].cpus(), granted);
    realtime.report();
    EXPECT_EQ(log.text().find("warning: realtime.cpus") != std::string::npos, warned) << log.text();
    EXPECT_EQ(log.text().empty(), asked.empty()) << log.text();
  }
}

/// As in sched_getattr(2).
struct Attributes {
  std::uint32_t size, policy;
  std::uint64_t flags;
  std::int32_t nice;
  std::uint32_t priority;
  std::uint64_t runtime_ns, deadline_ns, period_ns;
};

Attributes attributesOf(int threadId) {
  Attributes attributes{};
  EXPECT_EQ(syscall(SYS_sched_getattr, threadId, &attributes, sizeof attributes, 0), 0);
  return attributes;
}

TEST(Realtime, AsksForShortSlicesAloneByDefault) {
  Realtime realtime({});
  const test::CapturedLog log;
  realtime.lockMemory();
  Member member(realtime, "member");
  const Attributes before = attributesOf(0), after = attributesOf(threadCalled("member"));
  EXPECT_EQ(after.policy, std::uint32_t{SCHED_OTHER});
  EXPECT_EQ(after.nice, before.nice);
  if (before.runtime_ns > 0) {  // a kernel that knows slices
    EXPECT_EQ(after.runtime_ns, 100'000U);
  }
  EXPECT_EQ(threadsOf(realtime)["member"].priority(), 0U);
  realtime.report();
  EXPECT_EQ(log.text(), "");
}

}  // namespace
}  // namespace tractiond::realtime_test

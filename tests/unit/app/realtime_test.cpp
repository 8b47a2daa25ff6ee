#include "daemon/app/realtime.h"
#include "tests/support/captured_log.h"
#include "traction/v1/status.pb.h"

#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdlib>
#include <iostream>
#include <latch>
#include <map>
#include <set>
#include <sstream>
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

/// What this process may, asked of the kernel itself, in a thread that ends.
bool isGranted(int priority) {
  bool granted = false;
  std::thread([&] {
    sched_param param{};
    param.sched_priority = priority;
    granted = sched_setscheduler(0, SCHED_FIFO, &param) == 0;
  }).join();
  return granted;
}

void forbid(int resource) {
  const rlimit nothing{};
  setrlimit(static_cast<__rlimit_resource>(resource), &nothing);
}

/// In a process of its own, as it is, or in a user namespace where nothing is allowed; a failure of `body` is one here.
template <typename Body>
void inProcess(bool allowed, Body body) {
  const auto run = [&] {
    if (!allowed) {
      if (unshare(CLONE_NEWUSER) != 0 && geteuid() == 0 && setuid(65534) != 0) std::_Exit(2);
      forbid(RLIMIT_RTPRIO);
    }
    body();
    std::cerr << testing::Message() << (testing::Test::HasFailure() ? "failed" : "passed");
    std::fflush(stdout);
    std::_Exit(0);
  };
  EXPECT_EXIT(run(), testing::ExitedWithCode(0), "passed");
}

/// A thread that enters, and stays until it is told to go.
class Member {
 public:
  Member(Realtime& realtime, const char* name)
      : thread_([&, name] {
        pthread_setname_np(pthread_self(), name);
        realtime.enter();
        entered_.count_down();
        leave_.wait();
        std::thread([this] { childPolicy = sched_getscheduler(0); }).join();
        realtime.leave();
      }) {
    entered_.wait();
  }
  ~Member() { end(); }
  void end() {
    if (!thread_.joinable()) return;
    leave_.count_down();
    thread_.join();
  }
  int childPolicy = -1;  ///< of a thread that it starts, after the end

 private:
  std::latch entered_{1}, leave_{1};
  std::thread thread_;
};

void checkPriority(int priority) {
  const bool granted = isGranted(priority);
  std::cout << "  priority " << priority << (granted ? " is granted\n" : " is refused\n");
  Realtime realtime({.priority = priority});
  const test::CapturedLog log;
  Member one(realtime, "one"), two(realtime, "two");
  std::latch started(1), over(1);
  std::thread sender([&] {
    pthread_setname_np(pthread_self(), "sender");
    started.count_down();
    over.wait();
  });
  started.wait();
  realtime.adopt(threadCalled("sender"));
  auto threads = threadsOf(realtime);
  EXPECT_EQ(threads.size(), 3U);
  for (const char* name : {"one", "two"})
    EXPECT_EQ(static_cast<int>(threads[name].priority()), granted ? priority : 0) << name;
  EXPECT_EQ(static_cast<int>(threads["sender"].priority()), granted ? std::max(priority - 1, 1) : 0);
  EXPECT_EQ(sched_getscheduler(0), SCHED_OTHER);
  realtime.report();
  EXPECT_EQ(log.text().find("warning: realtime.priority = " + std::to_string(priority)) != std::string::npos, !granted)
      << log.text();
  EXPECT_NE(log.text().find("two " + std::to_string(granted ? priority : 0) + " on "), std::string::npos) << log.text();
  two.end();
  EXPECT_EQ(two.childPolicy, SCHED_OTHER);
  EXPECT_EQ(threadsOf(realtime).size(), 2U);
  over.count_down();
  sender.join();
}

TEST(Realtime, PriorityIsWhatTheKernelGrants) {
  for (const int priority : {1, 60, 98}) {
    for (const bool allowed : {true, false}) inProcess(allowed, [&] { checkPriority(priority); });
  }
}

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

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // which pass mlockall() over
std::uint64_t lockedMemory(Realtime& realtime) {
  traction::v1::Scheduling status;
  realtime.read(status);
  EXPECT_TRUE(status.asked_lock());
  return status.locked_bytes();
}

TEST(Realtime, MemoryIsLockedWhereItMayBeAndOnlyWithoutALimit) {
  for (const bool allowed : {true, false}) {
    for (const rlim_t limit : {rlim_t{0}, rlim_t{1} << 20, rlim_t{1} << 40}) {
      inProcess(allowed, [&] {
        const rlimit set{limit, limit};
        setrlimit(RLIMIT_MEMLOCK, &set);  // which may only make it smaller
        rlimit before{};
        getrlimit(RLIMIT_MEMLOCK, &before);
        Realtime realtime({.lockMemory = true});
        realtime.lockMemory();
        const std::uint64_t locked = lockedMemory(realtime);
        std::cout << "  " << (locked >> 20) << " MiB locked with a limit of " << before.rlim_cur << "\n";
        if (!allowed) {
          EXPECT_EQ(locked, 0U);
        }
        rlimit after{};
        getrlimit(RLIMIT_MEMLOCK, &after);
        EXPECT_EQ(after.rlim_cur, before.rlim_cur);
        // More is still to be had, and locked as well.
        EXPECT_NE(mmap(nullptr, 64U << 20, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0), MAP_FAILED);
        EXPECT_EQ(lockedMemory(realtime) > locked, locked > 0);
      });
    }
  }
}
#endif

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

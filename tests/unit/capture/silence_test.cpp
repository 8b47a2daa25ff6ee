// Why frames are missing.

#include "daemon/capture/silence.h"
#include "tests/support/deadline.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <thread>

namespace tractiond::capture::silence_test {
namespace {

/// A camera and a thread that receives, by the number of pauses that have passed.
struct Conditions {
  int takes = 1000;  ///< from here on the thread takes packets
  int runs = 0;      ///< until here it waits for a processor
  bool waiting = true, answers = true;
  std::uint64_t comesWithTheQuestion = 0;  ///< packets that are received while the camera is asked
  bool waitsAfterwards = false;            ///< a packet came, and nobody has fetched it yet
};

struct Scene final : StreamSigns {
  explicit Scene(const Conditions& conditions)
      : is(conditions) {}

  Silence cause() { return causeOfSilence(*this); }

  std::uint64_t received() override { return (pauses >= is.takes ? 100U : 0U) + late; }
  bool hasPacketsWaiting() override { return is.waiting; }
  bool isWaitingForProcessor() override { return pauses <= is.runs; }
  bool answers() override {
    late = is.comesWithTheQuestion;
    is.waiting = is.waitsAfterwards;
    return is.answers;
  }
  void pause() override { ++pauses; }

  Conditions is;
  int pauses = 0;
  std::uint64_t late = 0;
};

TEST(SilenceOf, ACameraThatAnswersIsAlive) {
  Scene scene({.waiting = false});
  EXPECT_EQ(scene.cause(), Silence::kAlive);
  EXPECT_EQ(scene.pauses, 0);
}

TEST(SilenceOf, ACameraThatNeitherAnswersNorSendsHasGone) {
  EXPECT_EQ(Scene({.waiting = false, .answers = false}).cause(), Silence::kNoAnswer);
}

TEST(SilenceOf, ACameraThatSendsIsAliveHoweverLateItAnswers) {
  EXPECT_EQ(Scene({.waiting = false, .answers = false, .comesWithTheQuestion = 1}).cause(), Silence::kAlive);
  EXPECT_EQ(Scene({.waiting = false, .answers = false, .waitsAfterwards = true}).cause(), Silence::kAlive);
}

TEST(SilenceOf, AThreadThatLeavesPacketsLieHangs) {
  Scene scene({});
  EXPECT_EQ(scene.cause(), Silence::kThreadHangs);
  EXPECT_EQ(scene.pauses, 5);
}

TEST(SilenceOf, AThreadThatIsNotLetRunDoesNotHang) {
  Scene starved({.takes = 20, .runs = 20});
  EXPECT_EQ(starved.cause(), Silence::kAlive);
  EXPECT_EQ(starved.pauses, 20);
  Scene hangsThen({.runs = 20});
  EXPECT_EQ(hangsThen.cause(), Silence::kThreadHangs);
  EXPECT_EQ(hangsThen.pauses, 25);
  Scene forEver({.runs = 1000});
  EXPECT_EQ(forEver.cause(), Silence::kThreadHangs);
  EXPECT_EQ(forEver.pauses, 40);
}

TEST(ProcessorWaitOf, AThreadThatSleepsIsNotWaiting) {
  std::atomic<int> id{0};
  std::atomic<bool> over{false};
  std::thread sleeper([&] {
    id = gettid();
    while (!over) poll(nullptr, 0, 10);
  });
  while (id == 0) sched_yield();
  ProcessorWait wait(id);
  int found = 0;
  EXPECT_TRUE(test::eventually([&] {  // it may wait now and then on a busy machine
    poll(nullptr, 0, 1);
    return !wait.lasts() && ++found > 10;
  }));
  over = true;
  sleeper.join();
}

TEST(ProcessorWaitOf, AThreadThatIsNotLetRunIsWaiting) {
  // Both on one processor, where the one gets what the other leaves.
  cpu_set_t all, one;
  sched_getaffinity(0, sizeof all, &all);
  CPU_ZERO(&one);
  for (int cpu = 0; cpu < CPU_SETSIZE && CPU_COUNT(&one) == 0; ++cpu)
    if (CPU_ISSET(cpu, &all)) CPU_SET(cpu, &one);
  std::atomic<int> id{0};
  std::atomic<bool> over{false};
  const auto spin = [&](bool modest) {
    sched_setaffinity(0, sizeof one, &one);
    const sched_param none{};
    if (modest) sched_setscheduler(0, SCHED_IDLE, &none);
    if (modest) id = gettid();
    while (!over) {
    }
  };
  std::thread hog([&] { spin(false); }), starved([&] { spin(true); });
  while (id == 0) sched_yield();
  ProcessorWait wait(id);
  EXPECT_TRUE(test::eventually([&] {
    poll(nullptr, 0, 1);
    return wait.lasts();
  }));
  over = true;
  hog.join();
  starved.join();
}

TEST(ProcessorWaitOf, AThreadThatIsNotThereIsNotWaiting) {
  EXPECT_FALSE(ProcessorWait(0).lasts());
}

}  // namespace
}  // namespace tractiond::capture::silence_test

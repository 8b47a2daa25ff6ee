#include "daemon/capture/inspection.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <csignal>

namespace tractiond::capture::child_test {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;
using How = ChildEnd::How;

ChildEnd shell(const std::string& script, const ChildOptions& options = {.program = "/bin/sh"}) {
  return runChild({"-c", script}, options);
}

TEST(Child, IsReadToItsEnd) {
  const ChildEnd end = shell("echo one; echo two >&2; cat; exit 7");  // nobody writes to it: cat ends at once
  EXPECT_EQ(end.how, How::kExit);
  EXPECT_EQ(end.code, 7);
  EXPECT_EQ(end.output, "one\n");
  EXPECT_EQ(end.errors, "two\n");
  EXPECT_EQ(misdeed(end), "");
}

TEST(Child, ACrashIsTold) {
  const ChildEnd end = shell("echo before; kill -SEGV $$");
  EXPECT_EQ(end.how, How::kSignal);
  EXPECT_EQ(end.code, SIGSEGV);
  EXPECT_EQ(end.output, "before\n");
  EXPECT_THAT(misdeed(end), HasSubstr("signal 11"));
}

TEST(Child, OneThatHangsIsEndedAfterItsTime) {
  const ChildOptions options{.program = "/bin/sh", .patience = milliseconds(100)};
  EXPECT_EQ(shell("exec sleep 1000", options).how, How::kLate);
  EXPECT_EQ(shell("exec sleep 1000 >/dev/null 2>&1", options).how, How::kLate) << "it says nothing, and lives on";
}

TEST(Child, OneThatTalksWithoutEndIsEnded) {
  EXPECT_EQ(shell("exec yes", {.program = "/bin/sh", .most_bytes = 100'000}).how, How::kTooMuch);
  EXPECT_EQ(shell("exec yes >&2", {.program = "/bin/sh", .most_bytes = 100'000}).how, How::kTooMuch);
}

TEST(Child, AStopEndsIt) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(runChild({"-c", "exec sleep 1000"}, {.program = "/bin/sh"}, stop.get_token()).how, How::kStopped);
}

TEST(Child, AProgramThatIsNotThereIsTold) {
  const ChildEnd end = runChild({}, {.program = "/nowhere/tractiond"});
  EXPECT_EQ(end.how, How::kNotStarted);
  EXPECT_EQ(end.code, ENOENT);
  EXPECT_THAT(misdeed(end), HasSubstr("No such file"));
}

TEST(Child, HasNoneOfOurFilesAndHearsSignalsThatWeBlock) {
  sigset_t usr, before;
  sigemptyset(&usr);
  sigaddset(&usr, SIGUSR1);
  pthread_sigmask(SIG_BLOCK, &usr, &before);
  const ChildEnd end = shell("ls /proc/self/fd | wc -l; kill -USR1 $$; echo deaf");
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  EXPECT_EQ(end.output, "4\n") << "standard ones, and the directory that ls reads";
  EXPECT_EQ(end.code, SIGUSR1);
}

/// Ctrl-C, Ctrl-\, a terminal that hangs up, systemd.
TEST(Child, ASignalThatEndsUsTogetherIsNotItsFault) {
  for (const char* signal : {"INT", "TERM", "HUP", "QUIT"}) {
    const ChildEnd end = shell("kill -" + std::string(signal) + " $$; echo on");
    EXPECT_EQ(misdeed(end), "") << signal;
    EXPECT_EQ(end.output, "on\n") << signal;
  }
}

}  // namespace
}  // namespace tractiond::capture::child_test

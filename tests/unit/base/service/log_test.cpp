#include "base/service/log.h"
#include "tests/support/deadline.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <array>
#include <memory>
#include <string>
#include <thread>
#include <utility>

namespace tractiond::log_test {
namespace {

class LogTest : public testing::Test {
 protected:
  LogTest() {
    std::array<int, 2> ends{};
    EXPECT_EQ(pipe2(ends.data(), O_CLOEXEC), 0);
    reader_ = ends[0];
    writer_ = ends[1];  // stays open: a thread may still stand before it
    EXPECT_GT(fcntl(writer_, F_SETPIPE_SZ, 4096), 0);
  }
  ~LogTest() override {
    spdlog::set_default_logger(before_);
    close(reader_);
  }
  /// Reads until a line says "end".
  std::string readToEnd() const {
    std::string text;
    std::array<char, 65536> some{};
    while (text.find("log: end\n") == std::string::npos) {
      const ssize_t got = read(reader_, some.data(), some.size());
      if (got <= 0) break;
      text.append(some.data(), static_cast<std::size_t>(got));
    }
    return text;
  }
  static void expectLost(const Log& log, std::uint64_t lines) {
    for (std::uint64_t i = 0; i < lines; ++i) spdlog::info("line");
    EXPECT_TRUE(test::eventually([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      return log.lost() >= lines;
    }));
    EXPECT_EQ(log.lost(), lines);
  }

  const std::shared_ptr<spdlog::logger> before_ = spdlog::default_logger();
  int reader_ = -1, writer_ = -1;
};

TEST_F(LogTest, WritesEveryLineInOrder) {
  Log log("log", "warning", writer_);
  std::string expected;
  for (int i = 0; i < 500; ++i) {
    spdlog::warn("{}", i);
    spdlog::info("is below the level");
    expected += "log: " + std::to_string(i) + "\n";
  }
  spdlog::warn("end");
  EXPECT_EQ(readToEnd(), expected + "log: end\n");
  EXPECT_EQ(log.lost(), 0U);
}

/// The reader stands still, and reads on: a line says how many are missing.
TEST_F(LogTest, CountsWhatAReaderThatStandsStillDoesNotGet) {
  constexpr int kLines = 10'000;
  Log log("log", "info", writer_);
  for (int i = 0; i < kLines; ++i) spdlog::info("{}", i);
  spdlog::info("end");
  int come = 0, told = 0, last = -1;
  const std::string text = readToEnd(), start = "log: ";
  for (std::size_t from = 0, end = 0; (end = text.find('\n', from)) != std::string::npos; from = end + 1) {
    const std::string line = text.substr(from, end - from);
    ASSERT_TRUE(line.starts_with(start)) << line;
    if (line == "log: end") continue;
    const int number = std::stoi(line.substr(start.size()));
    if (line.find(" lines of this log are lost") != std::string::npos) {
      told += number;
    } else {
      EXPECT_GT(number, std::exchange(last, number));
      ++come;
    }
  }
  EXPECT_GT(told, 0);
  EXPECT_EQ(come + told, kLines);
  EXPECT_EQ(log.lost(), static_cast<std::uint64_t>(told));
}

TEST_F(LogTest, EndsThoughNobodyReads) {
  Log log("log", "info", writer_);
  for (int i = 0; i < 2000; ++i) spdlog::info("{}", std::string(1000, 'x'));
  EXPECT_GT(log.lost(), 0U);
}

TEST_F(LogTest, CountsWhatAFullDiskDoesNotTake) {
  const int full = open("/dev/full", O_WRONLY | O_CLOEXEC);
  ASSERT_GE(full, 0);
  expectLost(Log("log", "info", full), 10);
}

}  // namespace
}  // namespace tractiond::log_test

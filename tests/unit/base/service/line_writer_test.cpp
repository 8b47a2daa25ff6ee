#include "base/service/line_writer.h"
#include "tests/support/deadline.h"
#include "tests/support/seed.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace tractiond::line_writer_test {
namespace {

class LineWriterTest : public testing::Test {
 protected:
  LineWriterTest() {
    std::array<int, 2> ends{};
    EXPECT_EQ(pipe2(ends.data(), O_CLOEXEC), 0);
    reader_ = ends[0];
    writer_ = ends[1];
    EXPECT_GT(fcntl(writer_, F_SETPIPE_SZ, 4096), 0);
  }
  ~LineWriterTest() override {
    if (reader_ >= 0) close(reader_);
    // The writer's end stays open: a thread may still stand before it.
  }
  std::string readAll() const {
    std::string text;
    std::array<char, 65536> some{};
    for (ssize_t got = 0; (got = read(reader_, some.data(), some.size())) > 0;)
      text.append(some.data(), static_cast<std::size_t>(got));
    return text;
  }
  static std::vector<std::string> lines(const std::string& text) {
    std::vector<std::string> found;
    for (std::size_t from = 0, end = 0; (end = text.find('\n', from)) != std::string::npos; from = end + 1)
      found.push_back(text.substr(from, end - from));
    return found;
  }

  static void expectAllLost(const LineWriter& log, std::uint64_t lines) {
    EXPECT_TRUE(test::eventually([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      return log.lost() >= lines;
    }));
    EXPECT_EQ(log.lost(), lines);
  }

  int reader_ = -1, writer_ = -1;
};

TEST_F(LineWriterTest, WritesEveryLineInOrder) {
  std::string text;
  std::thread reader([&] { text = readAll(); });
  {
    LineWriter log(writer_, {.patience = test::kHung});
    for (int i = 0; i < 5000; ++i) log.write(std::to_string(i));
    EXPECT_EQ(log.lost(), 0U);
  }
  close(writer_);
  reader.join();
  const auto found = lines(text);
  ASSERT_EQ(found.size(), 5000U);
  for (int i = 0; i < 5000; ++i) EXPECT_EQ(found[static_cast<std::size_t>(i)], std::to_string(i));
}

/// The reader stands still, and reads on: where lines are missing stands how many.
TEST_F(LineWriterTest, CountsWhatAReaderThatStandsStillDoesNotGet) {
  std::mt19937 random(test::seed());
  std::string text;
  std::uint64_t lost = 0;
  int next = 0;
  std::optional<LineWriter> log(std::in_place, writer_,
                                LineWriterOptions{.most_bytes = 20'000, .patience = test::kHung});
  for (int i = 0; i < 10'000; ++i) log->write(std::to_string(next++) + std::string(random() % 60, ' '));
  EXPECT_GT(log->lost(), 0U);
  std::thread reader([&] { text = readAll(); });
  for (int i = 0; i < 100; ++i) {
    log->write(std::to_string(next++));
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  lost = log->lost();
  log.reset();
  close(writer_);
  reader.join();

  int expected = 0;
  std::uint64_t told = 0;
  for (const std::string& line : lines(text)) {
    const std::string start = "tractiond: ";
    if (line.starts_with(start)) {
      const int missing = std::stoi(line.substr(start.size()));
      EXPECT_NE(line.find("lines of this log are lost"), std::string::npos);
      told += static_cast<std::uint64_t>(missing);
      expected += missing;
    } else {
      EXPECT_EQ(std::stoi(line), expected++);
    }
  }
  EXPECT_EQ(expected, next);
  EXPECT_EQ(told, lost);
}

TEST_F(LineWriterTest, EndsThoughNobodyReads) {
  LineWriter log(writer_, {.patience = std::chrono::milliseconds(50)});
  for (int i = 0; i < 1000; ++i) log.write(std::string(1000, 'x'));
  EXPECT_GT(log.lost(), 0U);
}

TEST_F(LineWriterTest, OutlivesItsReader) {
  close(std::exchange(reader_, -1));
  LineWriter log(writer_);
  for (int i = 0; i < 10; ++i) log.write("line");
  expectAllLost(log, 10);
}

TEST_F(LineWriterTest, CountsWhatAFullDiskDoesNotTake) {
  const int full = open("/dev/full", O_WRONLY | O_CLOEXEC);
  ASSERT_GE(full, 0);
  LineWriter log(full);
  for (int i = 0; i < 10; ++i) log.write("line");
  expectAllLost(log, 10);
}

}  // namespace
}  // namespace tractiond::line_writer_test

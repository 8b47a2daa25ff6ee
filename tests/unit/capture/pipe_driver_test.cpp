#include "base/clock.h"
#include "daemon/capture/camera.h"
#include "daemon/capture/pipe_driver.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <random>
#include <thread>

namespace tractiond::capture::pipe_driver_test {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

class PipeDriverTest : public testing::Test {
 protected:
  PipeDriverTest() {
    if (pipe(ends_) != 0) std::abort();
    options_ = {
        .path = "/dev/fd/" + std::to_string(ends_[0]), .format = "BayerRG8", .width = 40, .height = 30, .buffers = 9};
  }
  ~PipeDriverTest() override { close(ends_[0]); }

  /// Writes as any program would: in pieces that have nothing to do with pictures.
  void feed(const std::vector<std::uint8_t>& bytes, std::uint64_t seed) {
    writer_ = std::thread([this, bytes, seed] {
      std::mt19937_64 random(seed);
      for (std::size_t at = 0; at < bytes.size();) {
        const std::size_t piece = std::min<std::size_t>(bytes.size() - at, 1 + random() % 3000);
        if (write(ends_[1], bytes.data() + at, piece) < 0) break;
        at += piece;
      }
      close(ends_[1]);
    });
  }
  /// The first bytes of all pictures until the end.
  std::vector<int> takeAll() {
    std::vector<int> got;
    auto camera = Camera::open(fromPipe(options_), {.wait = false}, ledger_);
    EXPECT_TRUE(camera) << camera.error().message();
    Frame frame;
    for (Next next = Next::kTimeout; next != Next::kEnd;) {
      next = (*camera)->next(frame, milliseconds(100));
      if (next != Next::kFrame) continue;
      got.push_back(frame.data[0]);
      EXPECT_EQ(frame.stride, 40);
      (*camera)->recycle(frame);
    }
    end_ = (*camera)->error();
    writer_.join();
    return got;
  }

  int ends_[2] = {};
  PipeOptions options_;
  Ledger ledger_;
  std::thread writer_;
  Error end_;
};

TEST_F(PipeDriverTest, HandsOnEveryPictureAndEnds) {
  std::vector<std::uint8_t> bytes;
  for (int i = 0; i < 100; ++i) bytes.insert(bytes.end(), 1200, static_cast<std::uint8_t>(i));
  feed(bytes, test::seed());
  const std::vector<int> got = takeAll();
  ASSERT_EQ(got.size(), 100U);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(got[static_cast<std::size_t>(i)], i);
  EXPECT_EQ(end_.exitCode, EX_OK);
  EXPECT_EQ(ledger_.losses(), 0U);
}

TEST_F(PipeDriverTest, PictureUnderWayIsNotMixedWithOneThatIsGivenBack) {
  std::mt19937_64 random(test::seed());
  auto camera = Camera::open(fromPipe(options_), {.wait = false}, ledger_);
  ASSERT_TRUE(camera) << camera.error().message();
  constexpr std::size_t kSize = 1200, kPictures = 100;
  std::vector<Frame> held;
  for (std::size_t written = 0, got = 0; got < kPictures;) {
    if (written < kPictures * kSize) {
      const std::size_t piece = std::min<std::size_t>(1 + random() % 1000, kSize - written % kSize);
      const std::vector<std::uint8_t> bytes(piece, static_cast<std::uint8_t>(written / kSize));
      ASSERT_EQ(write(ends_[1], bytes.data(), piece), static_cast<ssize_t>(piece));
      written += piece;
    }
    Frame frame;
    if ((*camera)->next(frame, milliseconds(0)) == Next::kFrame) {
      for (std::size_t i = 0; i < kSize; ++i) ASSERT_EQ(frame.data[i], got);
      ++got;
      held.push_back(frame);
    }
    while (held.size() > 5 || (!held.empty() && random() % 4 == 0)) {
      const std::size_t one = random() % held.size();
      (*camera)->recycle(held[one]);
      held.erase(held.begin() + static_cast<std::ptrdiff_t>(one));
    }
  }
  for (Frame& frame : held) (*camera)->recycle(frame);
  camera->reset();
  close(ends_[1]);
}

TEST_F(PipeDriverTest, NamesThePictureInWhichItEnds) {
  feed(std::vector<std::uint8_t>(5 * 1200 + 700), 1);
  EXPECT_EQ(takeAll().size(), 5U);
  EXPECT_EQ(end_.exitCode, EX_DATAERR);
  EXPECT_THAT(end_.message(), HasSubstr("end within number 6: 700 of 1200 bytes"));
}

TEST_F(PipeDriverTest, SaysThatNoPictureCame) {
  feed({}, 1);
  EXPECT_EQ(takeAll().size(), 0U);
  EXPECT_EQ(end_.exitCode, EX_DATAERR);
  EXPECT_THAT(end_.message(), HasSubstr("end before the first one"));
}

TEST_F(PipeDriverTest, HandsOnNoSoonerThanTheirRate) {
  options_.frameRate_Hz = 200.0;
  constexpr std::size_t kPictures = 40;
  feed(std::vector<std::uint8_t>(kPictures * 1200), 1);
  const std::int64_t before_ns = monotonicNow();
  EXPECT_EQ(takeAll().size(), kPictures);
  // Between the first and the last there are 39 intervals of 5 ms; how much longer it takes is the machine's matter.
  EXPECT_GE(monotonicNow() - before_ns, 39 * 5'000'000);
}

TEST_F(PipeDriverTest, WantsToKnowWhatThePicturesAre) {
  options_.format = "";
  auto camera = Camera::open(fromPipe(options_), {.wait = false}, ledger_);
  ASSERT_FALSE(camera);
  EXPECT_EQ(camera.error().exitCode, EX_CONFIG);
  EXPECT_THAT(camera.error().message(), HasSubstr("camera.pixel_format"));
  close(ends_[1]);
}

TEST_F(PipeDriverTest, WaitsForTheWriterOfANamedPipeInItsTurns) {
  const test::TemporaryFolder folder;
  options_.path = folder.path() / "pictures";
  ASSERT_EQ(mkfifo(options_.path.c_str(), 0600), 0);
  Frame frame;
  {
    auto stopped = Camera::open(fromPipe(options_), {.wait = false}, ledger_);
    ASSERT_TRUE(stopped) << stopped.error().message();
    for (int i = 0; i < 3; ++i) EXPECT_EQ((*stopped)->next(frame, milliseconds(1)), Next::kTimeout);
  }
  close(ends_[1]);
  writer_ = std::thread([this] {
    ends_[1] = open(options_.path.c_str(), O_WRONLY);  // waits for the reader
    const std::vector<std::uint8_t> bytes(3 * 1200);
    EXPECT_EQ(write(ends_[1], bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
    close(ends_[1]);
  });
  EXPECT_EQ(takeAll().size(), 3U);
  EXPECT_EQ(end_.exitCode, EX_OK);
}

TEST_F(PipeDriverTest, SaysThatAFileIsNotThere) {
  options_.path = "/nowhere/pictures";
  auto camera = Camera::open(fromPipe(options_), {.wait = false}, ledger_);
  ASSERT_FALSE(camera);
  EXPECT_EQ(camera.error().exitCode, EX_NOINPUT);
  close(ends_[1]);
}

}  // namespace
}  // namespace tractiond::capture::pipe_driver_test

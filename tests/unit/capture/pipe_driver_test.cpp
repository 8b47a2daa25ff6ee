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
    options_ = {.images = "/dev/fd/" + std::to_string(ends_[0]),
                .pixelFormat = "BayerRG8",
                .width = 40,
                .height = 30,
                .buffers = 9};
  }
  ~PipeDriverTest() override { close(ends_[0]); }

  /// Writes so many bytes, which fit into the pipe, and ends.
  void feed(std::size_t bytes) {
    const std::vector<std::uint8_t> zeros(bytes);
    EXPECT_EQ(write(ends_[1], zeros.data(), bytes), static_cast<ssize_t>(bytes));
    close(ends_[1]);
  }
  /// Takes all pictures until the end, and returns their number.
  int takeAll() {
    int got = 0;
    auto camera = Camera::open(fromPipe(options_), {.wait = false, .stills = options_.stills}, ledger_);
    EXPECT_TRUE(camera) << camera.error().message();
    Frame frame;
    for (Next next = Next::kTimeout; next != Next::kEnd;) {
      next = (*camera)->next(frame, milliseconds(100));
      if (next != Next::kFrame) continue;
      ++got;
      EXPECT_EQ(frame.stride, 40);
      (*camera)->recycle(frame);
    }
    end_ = (*camera)->error();
    return got;
  }

  int ends_[2] = {};
  CameraOptions options_;
  Ledger ledger_;
  Error end_;
};

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

TEST_F(PipeDriverTest, OnePictureAgainAndAgainIsUsedOnlyWhereStillsAreMeant) {
  std::vector<std::uint8_t> still(1200);
  std::mt19937_64 random(test::seed());
  for (std::uint8_t& byte : still) byte = static_cast<std::uint8_t>(random());
  std::vector<std::uint8_t> other = still;
  other[10] ^= 1U;  // outside of the places that are compared first
  const std::vector<std::uint8_t> dark(1200, 0), bright(1200, 0xff), grey(1200, 90);
  const auto show = [&](const std::vector<std::uint8_t>& picture, int times) {
    for (int i = 0; i < times; ++i) ASSERT_EQ(write(ends_[1], picture.data(), picture.size()), 1200);
  };
  for (const bool stills : {false, true}) {
    options_.stills = stills;
    show(still, 9);
    show(other, 3);
    show(still, 1);
    for (const auto& picture : {dark, bright, grey}) show(picture, 7);
    close(ends_[1]);
    EXPECT_EQ(takeAll(), stills ? 34 : 4 + 3 + 1 + 7 + 7 + 4);
    EXPECT_EQ(ledger_.repeated.get(), 8U) << "a lens cap repeats without a fault";
    close(ends_[0]);
    ASSERT_EQ(pipe(ends_), 0);
    options_.images = "/dev/fd/" + std::to_string(ends_[0]);
  }
}

TEST_F(PipeDriverTest, NamesThePictureInWhichItEnds) {
  feed(5 * 1200 + 700);
  EXPECT_EQ(takeAll(), 5);
  EXPECT_EQ(end_.exitCode, EX_DATAERR);
  EXPECT_THAT(end_.message(), HasSubstr("end within number 6: 700 of 1200 bytes"));
}

TEST_F(PipeDriverTest, SaysThatNoPictureCame) {
  feed(0);
  EXPECT_EQ(takeAll(), 0);
  EXPECT_EQ(end_.exitCode, EX_DATAERR);
  EXPECT_THAT(end_.message(), HasSubstr("end before the first one"));
}

TEST_F(PipeDriverTest, HandsOnNoSoonerThanTheirRate) {
  options_.frameRate_Hz = 200.0;
  feed(std::size_t{40} * 1200);
  const std::int64_t before_ns = monotonicNow();
  EXPECT_EQ(takeAll(), 40);
  // Between the first and the last there are 39 intervals of 5 ms; how much longer it takes is the machine's matter.
  EXPECT_GE(monotonicNow() - before_ns, 39 * 5'000'000);
}

TEST_F(PipeDriverTest, WaitsForTheWriterOfANamedPipeInItsTurns) {
  const test::TemporaryFolder folder;
  options_.images = folder.path() / "pictures";
  ASSERT_EQ(mkfifo(options_.images.c_str(), 0600), 0);
  Frame frame;
  {
    auto stopped = Camera::open(fromPipe(options_), {.wait = false}, ledger_);
    ASSERT_TRUE(stopped) << stopped.error().message();
    for (int i = 0; i < 3; ++i) EXPECT_EQ((*stopped)->next(frame, milliseconds(1)), Next::kTimeout);
  }
  close(ends_[1]);
  std::jthread writer([this] {
    ends_[1] = open(options_.images.c_str(), O_WRONLY);  // waits for the reader
    feed(3 * 1200);
  });
  EXPECT_EQ(takeAll(), 3);
  EXPECT_EQ(end_.exitCode, EX_OK);
  EXPECT_EQ(ledger_.losses(), 0U);
}

TEST_F(PipeDriverTest, NeedsAFileThatIsThereAndToKnowWhatItsPicturesAre) {
  close(ends_[1]);
  CameraOptions absent = options_, unknown = options_;
  absent.images = "/nowhere/pictures";
  unknown.pixelFormat = "";
  EXPECT_EQ(fromPipe(absent)({}).error().exitCode, EX_NOINPUT);
  const auto driver = fromPipe(unknown)({});
  ASSERT_FALSE(driver);
  EXPECT_EQ(driver.error().exitCode, EX_CONFIG);
  EXPECT_THAT(driver.error().message(), HasSubstr("camera.pixel_format"));
}

}  // namespace
}  // namespace tractiond::capture::pipe_driver_test

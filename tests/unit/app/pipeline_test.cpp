#include "base/clock.h"
#include "daemon/app/pipeline.h"
#include "tests/support/deadline.h"

#include <gtest/gtest.h>
#include <poll.h>

#include <random>
#include <set>
#include <vector>

namespace tractiond::pipeline_test {
namespace {

using namespace std::chrono_literals;

constexpr PipelineOptions kSmall{.markers = 3, .nodes = 2};

/// Numbered frames from memory that must come back; some arrive broken.
class CountingSource : public capture::FrameSource {
 public:
  CountingSource(std::uint64_t count, Ledger& ledger, std::uint64_t brokenEvery = 0)
      : count_(count)
      , brokenEvery_(brokenEvery)
      , ledger_(ledger) {}

  capture::Next next(Frame& frame, std::chrono::milliseconds) override {
    if (sent_ == count_) return capture::Next::kEnd;
    ledger_.received.add();
    ++sent_;
    if (brokenEvery_ > 0 && sent_ % brokenEvery_ == 0) {
      ledger_.incomplete.add();
      return capture::Next::kRejected;
    }
    frame = {};
    frame.info.frameNumber = sent_;
    frame.info.times.received_ns = monotonicNow();
    frame.token = this;
    out_.insert(sent_);
    return capture::Next::kFrame;
  }

  void recycle(Frame& frame) override {
    EXPECT_EQ(out_.erase(frame.info.frameNumber), 1U);
    frame.token = nullptr;
  }

  std::size_t notGivenBack() const { return out_.size(); }

 private:
  std::uint64_t count_, brokenEvery_, sent_ = 0;
  Ledger& ledger_;
  std::set<std::uint64_t> out_;
};

/// Keeps the processor busy for a random while.
class Dawdle {
 public:
  Dawdle(unsigned seed, int most)
      : random_(seed)
      , steps_(0, most) {}
  void operator()() {
    std::atomic<int> left = steps_(random_) * 50;
    while (--left > 0) {
    }
  }

 private:
  std::minstd_rand random_;
  std::uniform_int_distribution<int> steps_;
};

/// Stages whose result depends on the frame alone.
struct Work : Stages {
  explicit Work(int slowness = 0)
      : slow{Dawdle{1, slowness}, Dawdle{2, slowness}, Dawdle{3, slowness}} {}
  virtual ~Work() = default;

  bool track(const Frame& frame, MarkerField& markers) override {
    slow[0]();
    markers.flags = 0;
    markers.displacement_px[0] = static_cast<float>(frame.info.frameNumber);
    return frame.info.frameNumber > restFrames;
  }
  void solve(const MarkerField& markers, TractionField& field) override {
    slow[1]();
    field.markers = markers;
    field.flags = markers.flags;
    field.force_N[0] = 2.0F * markers.displacement_px[0];
  }
  void publish(const TractionField& field) override {
    slow[2]();
    published.push_back(field);
  }
  void serveSubscribers(int fd, std::chrono::milliseconds timeout) override {
    pollfd item{fd, POLLIN, 0};
    poll(&item, 1, static_cast<int>(timeout.count()));
  }

  std::uint64_t restFrames = 0;
  std::array<Dawdle, 3> slow;
  std::vector<TractionField> published;
  Turns turns;
};

TEST(Pipeline, AccountsForEveryFrameWhenStagesDawdleAndEvict) {
  for (const int slowness : {0, 20, 200}) {
    Ledger ledger;
    CountingSource source(5000, ledger, 7);
    Work work(slowness);
    work.restFrames = 20;
    Pipeline pipeline(source, work, kSmall, ledger, work.turns);
    pipeline.start();
    pipeline.finish();
    EXPECT_TRUE(pipeline.ended());
    EXPECT_TRUE(balanced(ledger));
    EXPECT_EQ(ledger.received.get(), 5000U);
    EXPECT_EQ(ledger.incomplete.get(), 5000U / 7);
    EXPECT_EQ(ledger.discardedAtStop.get(), 0U);
    EXPECT_EQ(work.published.size(), ledger.published.get());
    EXPECT_EQ(source.notGivenBack(), 0U);
    std::uint64_t last = 0;
    for (const TractionField& field : work.published) {
      EXPECT_GT(field.markers.info.frameNumber, last);
      last = field.markers.info.frameNumber;
    }
    EXPECT_EQ(last, 5000U) << "newest wins";
  }
}

TEST(Pipeline, ThatWaitsPassesEveryFrameThroughAllStagesInItsOrder) {
  Ledger ledger;
  CountingSource source(2000, ledger, 11);
  Work work(20);
  work.restFrames = 50;
  PipelineOptions options = kSmall;
  options.whenFull = WhenFull::kWait;
  Pipeline pipeline(source, work, options, ledger, work.turns);
  pipeline.start();
  pipeline.finish();
  EXPECT_TRUE(balanced(ledger));
  EXPECT_EQ(ledger.noRestPose.get(), 50U - 50 / 11);
  EXPECT_EQ(work.published.size(), 2000U - 2000 / 11 - ledger.noRestPose.get());
  EXPECT_EQ(source.notGivenBack(), 0U);
  std::uint64_t frame = 50;
  for (const TractionField& field : work.published) {
    do ++frame;
    while (frame % 11 == 0);
    EXPECT_EQ(field.markers.info.frameNumber, frame);
    EXPECT_EQ(field.force_N[0], 2.0F * static_cast<float>(frame));
  }
}

TEST(Pipeline, StopsAnEndlessSourceAndWorksOffWhatItHas) {
  Ledger ledger;
  CountingSource source(~std::uint64_t{0}, ledger);
  Work work(50);
  PipelineOptions options = kSmall;
  options.whenFull = WhenFull::kWait;
  Pipeline pipeline(source, work, options, ledger, work.turns);
  pipeline.start();
  while (ledger.published.get() < 100) std::this_thread::yield();
  pipeline.stop();
  EXPECT_TRUE(balanced(ledger));
  EXPECT_FALSE(pipeline.ended());
  EXPECT_EQ(ledger.published.get(), ledger.received.get()) << "nothing was thrown away";
  EXPECT_EQ(source.notGivenBack(), 0U);
  pipeline.stop();  // a second time does nothing
}

TEST(Pipeline, WaitsForFieldsAfterTheLastOne) {
  /// Frames, then a timeout at once, again and again.
  class FallsSilent : public CountingSource {
   public:
    using CountingSource::CountingSource;
    capture::Next next(Frame& frame, std::chrono::milliseconds timeout) override {
      const capture::Next what = CountingSource::next(frame, timeout);
      if (what != capture::Next::kEnd) return what;
      std::this_thread::yield();
      return capture::Next::kTimeout;
    }
  };
  Ledger ledger;
  FallsSilent source(10, ledger);
  struct Waiting final : Work {
    void serveSubscribers(int fd, std::chrono::milliseconds timeout) override {
      pollfd item{fd, POLLIN, 0};
      const bool timedOut = poll(&item, 1, static_cast<int>(timeout.count())) == 0;
      if (timedOut && timeout > 0ms && published.size() == 10) waited = true;
    }
    std::atomic<bool> waited{false};
  } work;
  PipelineOptions options = kSmall;
  options.turn = 1ms;
  options.whenFull = WhenFull::kWait;
  Pipeline pipeline(source, work, options, ledger, work.turns);
  pipeline.start();
  EXPECT_TRUE(test::eventually([&] {
    std::this_thread::yield();
    return work.waited.load();
  }));
  pipeline.stop();
}

}  // namespace
}  // namespace tractiond::pipeline_test

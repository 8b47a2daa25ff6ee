#include "daemon/app/prompt_solver.h"
#include "daemon/solve/field_rules.h"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>

namespace tractiond {
namespace {

using namespace std::chrono_literals;

constexpr int kMarkers = 4, kNodes = 2;

/// A solver whose model holds for the frames before `ends`, once it has learnt one.
class Double : public solve::FieldSolver {
 public:
  explicit Double(std::uint64_t ends)
      : ends_(ends) {}
  void solve(const MarkerField& markers, TractionField& field) noexcept override {
    complete(markers, field);
    field.solution = Solution::kFull;
    solved_ = markers.info.frameNumber;
  }
  bool learn() override {
    model.store(solved_);
    return true;
  }
  bool answer(const MarkerField& markers, TractionField& field) noexcept override {
    solve::clear(field);
    field.markers = markers;
    field.flags = markers.flags;
    if (model == 0 || markers.info.frameNumber >= ends_) return false;
    complete(markers, field);
    field.solution = Solution::kLinear;
    field.modelFrame = model;
    return true;
  }
  std::array<double, 2> detectionLimit_N() const override { return {}; }

  std::atomic<std::uint64_t> model{0};

 private:
  static void complete(const MarkerField& markers, TractionField& field) {
    field.markers = markers;
    field.valid = true;
    field.method = Method::kContact;
    field.resultant_N = {0.0, 0.0, static_cast<double>(markers.info.frameNumber)};
  }

  const std::uint64_t ends_;
  std::uint64_t solved_ = 0;
};

MarkerField frame(std::uint64_t number, std::uint32_t flags = 0) {
  MarkerField markers;
  markers.resize(kMarkers);
  markers.info.frameNumber = number;
  markers.info.times.received_ns = static_cast<std::int64_t>(number) * 10'000'000;
  markers.flags = flags;
  return markers;
}

TractionField blank() {
  TractionField field;
  field.resize(kMarkers, kNodes);
  return field;
}

TEST(FrameInterval, DoesNotGrowByFramesThatWereEvicted) {
  FrameInterval interval;
  FrameInfo frame;
  for (const std::uint64_t number : {7, 8, 20, 21}) {
    frame.frameNumber = number;
    frame.times.received_ns = 5'000'000 * static_cast<std::int64_t>(number);
    EXPECT_EQ(interval.next(frame), std::chrono::milliseconds(5)) << number;
  }
}

TEST(PromptSolver, ModelsTheNewestFrame) {
  const auto solver = std::make_shared<Double>(1000);
  solver->model = 1;
  PromptSolver prompt({}, kMarkers, kNodes);
  TractionField field = blank();
  for (std::uint64_t number = 2; number <= 5; ++number) prompt.solve(solver, frame(number), field);
  prompt.turn(0ms);
  EXPECT_EQ(solver->model, 5U);
}

TEST(PromptSolver, MakesNoMoreModelsThanItMay) {
  const auto solver = std::make_shared<Double>(1000);
  solver->model = 1;
  PromptSolver prompt({.models_Hz = 1e-3}, kMarkers, kNodes);
  TractionField field = blank();
  for (std::uint64_t number = 2; number <= 5; ++number) {
    prompt.solve(solver, frame(number), field);
    prompt.turn(0ms);
  }
  EXPECT_EQ(solver->model, 2U);
}

}  // namespace
}  // namespace tractiond

#include "daemon/app/rest_solver.h"
#include "tests/support/deadline.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/solve/sensors.h"

#include <gtest/gtest.h>

#include <thread>

namespace tractiond::rest_solver_test {
namespace {

namespace fs = std::filesystem;

/// A gel whose factors are computed at once, and the solver for its places in the gel file.
class RestSolverTest : public testing::Test {
 protected:
  RestSolverTest() {
    sensor_.layers.front().columns = sensor_.layers.front().rows = 3;
    sensor_.layers.resize(1);
    sensor_.nodes.columns = sensor_.nodes.rows = 2;
    options_.model = sensor::elastic::Model::kHalfSpace;
    drawn_ = solve::makeSolver(sensor_, options_, directory_).value().solver;
    rest_.emplace(sensor_, options_, directory_, drawn_, worker_);
  }

  RestPose zero(std::uint8_t id = 1) const {
    const sensor::Points markers = sensor::markerPositions(sensor_);
    const sensor::Projection project(sensor_.camera, sensor_.gel.size.z());
    RestPose pose;
    for (const auto& marker : markers.colwise()) {
      const Eigen::Vector2f pixel = project(marker).cast<float>();
      pose.position_px.insert(pose.position_px.end(), {pixel.x(), pixel.y()});
    }
    pose.present.assign(static_cast<std::size_t>(markers.cols()), 1);
    pose.id.fill(id);
    return pose;
  }

  /// Turns until nothing is left to do.
  void settle() {
    EXPECT_TRUE(test::eventually([this] {
      std::this_thread::yield();
      rest_->turn();
      return rest_->idle();
    }));
  }

  /// Takes what waits for the next frame, as the tracking and then the solving thread do.
  void pass(PlacedSolver& solver) {
    Id places = solver.zero;
    rest_->advanceZero(places);
    rest_->take(solver, places);
  }

  sensor::Sensor sensor_;
  solve::SolveOptions options_;
  const test::TemporaryFolder temporary_;
  const fs::path& directory_ = temporary_.path();
  std::shared_ptr<solve::FieldSolver> drawn_;
  BackgroundThread worker_{"test"};
  std::optional<RestSolver> rest_;
};

TEST_F(RestSolverTest, EachZeroGivesASolverOnce) {
  PlacedSolver solver{drawn_};
  rest_->request(zero());
  settle();
  EXPECT_EQ(rest_->done(), 1U);
  pass(solver);
  const auto first = solver.solver;
  EXPECT_NE(first, drawn_);
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(first->detectionLimit_N(), drawn_->detectionLimit_N());
  pass(solver);
  EXPECT_EQ(solver.solver, first);
  rest_->request(zero(2));
  settle();
  EXPECT_EQ(rest_->done(), 2U);
  pass(solver);
  EXPECT_NE(solver.solver, first);
  ASSERT_NE(solver.solver, nullptr);
}

/// Two of them take twice the memory.
TEST_F(RestSolverTest, AReplacedSolverIsFreed) {
  PlacedSolver solver{std::move(drawn_)};
  const std::weak_ptr<solve::FieldSolver> drawn = solver.solver;
  rest_->request(zero());
  settle();
  pass(solver);
  EXPECT_FALSE(drawn.expired()) << "not by the solving thread";
  rest_->turn();
  EXPECT_TRUE(drawn.expired());
  EXPECT_NE(solver.solver, nullptr);
}

/// Frames that one zero was told for are solved by its solver, though another one is ready.
TEST_F(RestSolverTest, ASolverIsNotOvertaken) {
  PlacedSolver solver{drawn_};
  Id seen{};
  rest_->request(zero(1));
  settle();
  rest_->advanceZero(seen);
  rest_->request(zero(2));
  settle();
  rest_->advanceZero(seen);
  EXPECT_EQ(seen, zero(1).id);
  rest_->take(solver, seen);
  EXPECT_EQ(solver.zero, zero(1).id);
  rest_->advanceZero(seen);
  EXPECT_EQ(seen, zero(2).id);
  rest_->take(solver, zero(1).id);
  EXPECT_EQ(solver.zero, zero(1).id) << "frames from before the second";
  rest_->take(solver, seen);
  EXPECT_EQ(solver.zero, zero(2).id);
}

TEST_F(RestSolverTest, AStopGivesUpTheSolverThatIsBeingMade) {
  PlacedSolver solver{drawn_};
  std::promise<void> begin;
  worker_.run([begun = begin.get_future().share()] { begun.wait(); });
  rest_->request(zero());
  rest_->stop();
  begin.set_value();
  settle();
  EXPECT_EQ(rest_->done(), 1U);
  pass(solver);
  EXPECT_EQ(solver.solver, drawn_);
}

/// Before the first step, after it, and so on to the one before the last.
TEST_F(RestSolverTest, BetweenItsStepsAStopIsNoticed) {
  const RestPose pose = zero();
  const auto make = [&](const std::function<bool()>& stopping) {
    return solve::makeSolverAtRest(sensor_, options_, directory_, pose.position_px, pose.present,
                                   drawn_->detectionLimit_N(), {}, stopping);
  };
  int steps = 0;
  ASSERT_TRUE(make([&] { return ++steps < 0; }));
  EXPECT_GE(steps, 4);
  for (int last = 1; last <= steps; ++last) {
    int asked = 0;
    EXPECT_FALSE(make([&] { return ++asked >= last; })) << last;
    EXPECT_EQ(asked, last) << "nothing is begun afterwards";
  }
}

}  // namespace
}  // namespace tractiond::rest_solver_test
